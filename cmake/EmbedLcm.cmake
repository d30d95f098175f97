# Writes a .cpp that holds the texts of message definitions for lcmtypes/lcm_texts.h.
# Usage: cmake -DOUT=file.cpp "-DTODAY=a.lcm;b.lcm" "-DHISTORY=1.lcm;2.lcm" -P EmbedLcm.cmake
set(today "")
foreach(file IN LISTS TODAY)
  file(READ ${file} text)
  string(APPEND today "R\"lcm(${text})lcm\"\n")
endforeach()
set(history "")
foreach(file IN LISTS HISTORY)
  file(READ ${file} text)
  string(APPEND history "R\"lcm(${text})lcm\",\n")
endforeach()
file(WRITE ${OUT} "#include \"lcmtypes/lcm_texts.h\"

namespace chase {

std::string LcmToday() {
  return
${today};
}

std::vector<std::string> LcmHistory() {
  return {
${history}};
}

}  // namespace chase
")
