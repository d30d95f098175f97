#include "deploy/detect/detect_command.h"

int main(int argc, char** argv) { return chase::perception::Detect(argc, argv); }
