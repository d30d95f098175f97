#include "services/perception/tools/detect_command.h"

int main(int argc, char** argv) { return chase::perception::Detect(argc, argv); }
