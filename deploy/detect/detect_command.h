#pragma once

namespace chase::perception {

/// `chase-detect PICTURE|FOLDER|VIDEO ... --config FILE [--json] [--out FOLDER] [--evaluate
/// MASKS]`: the target in pictures and videos. Exit code 0, or 1 after a line on stderr for each
/// file that cannot be read.
int Detect(int argc, char** argv);

}  // namespace chase::perception
