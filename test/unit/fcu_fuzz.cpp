// Random and mutated bytes into the codec and the bridge: fcu_fuzz SECONDS [SEED]. For the
// sanitizers to judge.
#include <chrono>
#include <cstdio>
#include <cstdlib>

#include "fcu_random.h"
#include "services/fcu/bridge.h"

namespace {

using namespace chase::fcu;  // NOLINT(google-build-using-namespace)
namespace mavlink = chase::mavlink;
using chase::world::Random;

constexpr int64_t kUtime = 1'800'000'000'000'000;

std::vector<uint8_t> Noise(Random* random) {
  std::vector<uint8_t> bytes(random->Next() % 600);
  for (uint8_t& b : bytes) {
    const uint64_t r = random->Next();
    b = static_cast<uint8_t>(r % 16 == 0 ? 0xFD + r / 16 % 2 : r >> 8);  // often a magic byte
  }
  return bytes;
}

std::vector<uint8_t> Frames(Random* random, FrameWriter* plain, FrameWriter* sealed) {
  std::vector<uint8_t> bytes;
  for (uint64_t n = random->Next() % 6; n > 0; --n)
    mavlink::testing::WithType(random->Next() % mavlink::testing::kTypes, [&](auto type) {
      const auto message = mavlink::testing::RandomMessage<decltype(type)>(random);
      const auto frame = (random->Next() % 4 == 0 ? sealed : plain)->Write(kUtime, message);
      bytes.insert(bytes.end(), frame.begin(), frame.end());
    });
  return bytes;
}

void Mutate(Random* random, std::vector<uint8_t>* bytes) {
  for (uint64_t n = random->Next() % 4; n > 0 && !bytes->empty(); --n) {
    const auto at = bytes->begin() + static_cast<std::ptrdiff_t>(random->Next() % bytes->size());
    switch (random->Next() % 4) {
      case 0:
        *at ^= static_cast<uint8_t>(1u << random->Next() % 8);
        break;
      case 1:
        bytes->erase(at);
        break;
      case 2:
        bytes->insert(at, static_cast<uint8_t>(random->Next()));
        break;
      default:
        bytes->erase(at, bytes->end());
    }
  }
}

/// What a frame says, in a number, so that every field is read.
struct Sum {
  double total = 0;
  template <class T>
  void operator()(const char*, std::size_t, const T& field) {
    total += static_cast<double>(field);
  }
  template <class T, std::size_t N>
  void operator()(const char*, std::size_t, const std::array<T, N>& field) {
    for (const T& value : field) total += static_cast<double>(value);
  }
};

}  // namespace

int main(int argc, char** argv) {
  const double seconds = argc > 1 ? std::atof(argv[1]) : 1.0;
  Random random(argc > 2 ? std::strtoull(argv[2], nullptr, 10) : 1);
  Signing ours(Key{}, 1), theirs(Key{}, 2);
  FrameReader plain, sealed(&ours);
  FrameWriter writer(1, 1), signer(1, 1, &theirs);
  Bridge bridge{FcuConfig{}};
  int64_t now = kUtime;
  Sum sum;
  int64_t bytes_read = 0;
  const auto take = [&](const Frame& frame) {
    mavlink::testing::ForEachType([&](auto type) {
      using M = decltype(type);
      if (const auto message = As<M>(frame)) M::Visit(*message, sum);
    });
  };
  const auto start = std::chrono::steady_clock::now();
  while (std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count() <
         seconds) {
    auto bytes = random.Next() % 2 ? Noise(&random) : Frames(&random, &writer, &signer);
    Mutate(&random, &bytes);
    for (std::size_t at = 0; at < bytes.size();) {
      const std::size_t piece = std::min(bytes.size() - at, std::size_t{1} + random.Next() % 300);
      plain.Add(kUtime, bytes.data() + at, piece, take);
      sealed.Add(kUtime, bytes.data() + at, piece, take);
      at += piece;
    }
    now += static_cast<int64_t>(random.Next() % 20'000);
    bridge.Receive(now, now, bytes.data(), bytes.size(), random.Next() % 2 == 0);
    bridge.Tick(now);
    bridge.TakeOutgoing();
    bridge.TakeImu();
    sum.total += static_cast<double>(bridge.Words().size());
    bytes_read += static_cast<int64_t>(bytes.size());
    if (random.Next() % 3 == 0) plain.Reset();
  }
  std::printf("%lld bytes, %lld frames heard, %lld broken, %lld refused\n",
              static_cast<long long>(bytes_read), static_cast<long long>(plain.counters().frames),
              static_cast<long long>(plain.counters().bad_checksum),
              static_cast<long long>(sealed.counters().refused));
  return plain.counters().frames > 0 ? 0 : 1;
}
