#pragma once

#include <string>
#include <vector>

namespace chase {

/// The texts of all .lcm files that this program was built from.
std::string LcmToday();
/// The texts of history/, oldest first: the messages as each earlier version had them.
std::vector<std::string> LcmHistory();

}  // namespace chase
