#include "logs/src/input.h"

#include <lzma.h>

#include <filesystem>
#include <fstream>
#include <iterator>
#include <stdexcept>

namespace chase::logs {
namespace {

std::vector<uint8_t> Unpack(const std::vector<uint8_t>& packed, const std::string& file) {
  lzma_stream stream = LZMA_STREAM_INIT;
  if (lzma_stream_decoder(&stream, UINT64_MAX, LZMA_CONCATENATED) != LZMA_OK)
    throw std::runtime_error(file + ": no memory to unpack it");
  std::vector<uint8_t> out, chunk(1 << 20);
  stream.next_in = packed.data();
  stream.avail_in = packed.size();
  lzma_ret status = LZMA_OK;
  while (status == LZMA_OK) {
    stream.next_out = chunk.data();
    stream.avail_out = chunk.size();
    status = lzma_code(&stream, LZMA_FINISH);
    out.insert(out.end(), chunk.begin(), chunk.end() - static_cast<long>(stream.avail_out));
  }
  lzma_end(&stream);
  if (status != LZMA_STREAM_END)
    throw std::runtime_error(file + ": is damaged or no xz file; fetch it again");
  return out;
}

}  // namespace

std::vector<uint8_t> ReadInput(const std::string& file) {
  if (!std::filesystem::is_regular_file(file))
    throw std::runtime_error(file + ": no such file; check the path");
  std::ifstream in(file, std::ios::binary);
  if (!in) throw std::runtime_error(file + ": cannot be opened; check its permissions");
  std::vector<uint8_t> bytes((std::istreambuf_iterator<char>(in)), {});
  if (bytes.empty()) throw std::runtime_error(file + ": is empty; fetch it again");
  return std::filesystem::path(file).extension() == ".xz" ? Unpack(bytes, file) : bytes;
}

}  // namespace chase::logs
