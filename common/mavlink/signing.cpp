#include "common/mavlink/signing.h"

#include <openssl/evp.h>

#include <algorithm>

namespace chase::mavlink {
namespace {

constexpr int64_t kEpoch = 1'420'070'400'000'000;  // 2015-01-01, microseconds since 1970
constexpr int64_t kMinute = 6'000'000;             // of 10 us: the guide's limit for a new link
constexpr std::size_t kDigestBytes = 6;

int64_t ReadTime(const uint8_t* p) {
  int64_t t = 0;
  for (int i = 5; i >= 0; --i) t = t << 8 | p[i];
  return t;
}

}  // namespace

int64_t SignatureTime(int64_t utime) { return std::max<int64_t>(0, (utime - kEpoch) / 10); }

std::array<uint8_t, 6> Signing::Digest(const uint8_t* data, std::size_t size) const {
  std::vector<uint8_t> text(key_.begin(), key_.end());
  text.insert(text.end(), data, data + size);
  uint8_t hash[EVP_MAX_MD_SIZE] = {};
  EVP_Digest(text.data(), text.size(), hash, nullptr, EVP_sha256(), nullptr);
  std::array<uint8_t, 6> first{};
  std::copy_n(hash, first.size(), first.begin());
  return first;
}

// Never behind what has been sent or heard: a host whose clock is set back goes on being believed.
int64_t Signing::Now(int64_t utime) const { return std::max(SignatureTime(utime), newest_); }

void Signing::Sign(int64_t utime, std::vector<uint8_t>* frame) {
  newest_ = std::max(SignatureTime(utime), newest_ + 1);
  frame->push_back(link_);
  for (int i = 0; i < 6; ++i) frame->push_back(static_cast<uint8_t>(newest_ >> (8 * i)));
  const auto digest = Digest(frame->data(), frame->size());
  frame->insert(frame->end(), digest.begin(), digest.end());
}

Signing::Verdict Signing::Judge(int64_t utime, uint8_t system, uint8_t component,
                                const uint8_t* frame, std::size_t size) {
  if (size < kSignatureBytes) return Verdict::kRefused;
  const uint8_t* signature = frame + size - kSignatureBytes;
  const int64_t time = ReadTime(signature + 1);
  const auto stream = std::make_tuple(system, component, signature[0]);
  const auto last = heard_.find(stream);
  if (last != heard_.end() && time <= last->second) return Verdict::kRefused;
  const auto digest = Digest(frame, size - kDigestBytes);
  if (!std::equal(digest.begin(), digest.end(), frame + size - kDigestBytes))
    return Verdict::kRefused;
  if (last == heard_.end() && time < Now(utime) - kMinute) return Verdict::kLate;
  heard_[stream] = time;
  newest_ = std::max(newest_, time);
  return Verdict::kGenuine;
}

}  // namespace chase::mavlink
