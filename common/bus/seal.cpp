#include "common/bus/seal.h"

#include <openssl/crypto.h>
#include <openssl/hmac.h>

#include <algorithm>
#include <cctype>
#include <fstream>
#include <stdexcept>

namespace chase::bus {

void Seal::Close(const std::string& name, std::vector<uint8_t>* bytes) const {
  if (!on()) return;
  const auto tag = Tag(name, bytes->data(), bytes->size());
  bytes->insert(bytes->end(), tag.begin(), tag.end());
}

std::optional<size_t> Seal::Open(const std::string& name, const uint8_t* data, size_t size) const {
  if (!on()) return size;
  if (size < kTagBytes) return std::nullopt;
  const size_t inside = size - kTagBytes;
  const auto tag = Tag(name, data, inside);
  if (CRYPTO_memcmp(tag.data(), data + inside, kTagBytes) != 0) return std::nullopt;
  return inside;
}

std::array<uint8_t, Seal::kTagBytes> Seal::Tag(const std::string& name, const uint8_t* data,
                                               size_t size) const {
  std::vector<uint8_t> text(name.c_str(), name.c_str() + name.size() + 1);
  text.insert(text.end(), data, data + size);
  uint8_t whole[EVP_MAX_MD_SIZE] = {};
  HMAC(EVP_sha256(), key_->data(), static_cast<int>(key_->size()), text.data(), text.size(), whole,
       nullptr);
  std::array<uint8_t, kTagBytes> tag{};
  std::copy_n(whole, kTagBytes, tag.begin());
  return tag;
}

bool Heard::IsNew(const MessageHead& head) {
  const auto [newest, first] = newest_.try_emplace({head.sender, head.sender_start}, head.seq);
  if (!first && head.seq <= newest->second) return false;
  newest->second = head.seq;
  return true;
}

Seal LoadSeal(const std::string& file) {
  if (file.empty()) return Seal();
  std::ifstream in(file);
  std::string digits;
  for (std::string word; in >> word;) digits += word;
  Seal::Key key{};
  const bool all = std::all_of(digits.begin(), digits.end(),
                               [](unsigned char c) { return std::isxdigit(c) != 0; });
  if (!all || digits.size() != 2 * key.size())
    throw std::runtime_error("key file " + file +
                             " does not hold 64 hexadecimal digits; make one " +
                             "with: openssl rand -hex 32");
  for (size_t i = 0; i < key.size(); ++i)
    key[i] = static_cast<uint8_t>(std::stoi(digits.substr(2 * i, 2), nullptr, 16));
  return Seal(key);
}

}  // namespace chase::bus
