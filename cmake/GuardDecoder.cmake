# Makes a generated decoder refuse an array length that the remaining bytes cannot hold, before it
# allocates. Usage: cmake -DHEADER=file -P GuardDecoder.cmake
file(READ ${HEADER} text)
string(REGEX REPLACE "this->([a-z_0-9]+)\\.resize\\(this->([a-z_0-9]+)\\);"
  "if(this->\\2 < 0 || this->\\2 > maxlen - pos) return -1;\n        this->\\1.resize(this->\\2);"
  text "${text}")
file(WRITE ${HEADER} "${text}")
