# Makes a generated decoder refuse an array length that the remaining bytes cannot hold, before it
# allocates, and a text whose only zero is not its last byte: it would be written up to the zero. Usage: cmake -DHEADER=file -P GuardDecoder.cmake
file(READ ${HEADER} text)
string(REGEX REPLACE "this->([a-z_0-9]+)\\.resize\\(this->([a-z_0-9]+)\\);"
  "if(this->\\2 < 0 || this->\\2 > maxlen - pos) return -1;\n        this->\\1.resize(this->\\2);"
  text "${text}")
string(REGEX REPLACE "if\\((__[a-z_0-9]+_len(__)?) > maxlen - pos\\) return -1;"
  "if(\\1 < 1 || \\1 > maxlen - pos || memchr((const char*)buf + offset + pos, 0, \\1) != (const char*)buf + offset + pos + \\1 - 1) return -1;"
  text "${text}")
file(WRITE ${HEADER} "${text}")
