#include "common/config/checksum.h"

namespace chase::config {
namespace {

constexpr uint32_t kPolynomial = 0x04C11DB7;  // of ISO/IEC 8802-3, the highest bit left out

uint32_t WithByte(uint32_t crc, uint32_t byte) {
  crc ^= byte << 24;
  for (int bit = 0; bit < 8; ++bit) crc = (crc << 1) ^ ((crc >> 31) * kPolynomial);
  return crc;
}

}  // namespace

uint32_t Checksum(const std::string& bytes) {
  uint32_t crc = 0;
  for (const char c : bytes) crc = WithByte(crc, static_cast<unsigned char>(c));
  for (size_t n = bytes.size(); n > 0; n >>= 8) crc = WithByte(crc, n & 0xFF);
  return ~crc;
}

}  // namespace chase::config
