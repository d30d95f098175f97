// The side of our codec in the comparison with node-mavlink (fcu_exchange.mjs).
//   fcu_exchange make SEED COUNT   random frames: a line each of hex, name and values
//   fcu_exchange read              lines of hex in; hex of the same frame anew, name, values out
#include <cstdio>
#include <cstdlib>
#include <iostream>
#include <sstream>
#include <string>

#include "fcu_random.h"

namespace {

using namespace chase::mavlink;  // NOLINT(google-build-using-namespace)

constexpr int64_t kUtime = 1'800'000'000'000'000;

Key TestKey() {
  Key key;
  for (std::size_t i = 0; i < key.size(); ++i) key[i] = static_cast<uint8_t>(i);
  return key;
}

std::string Hex(const std::vector<uint8_t>& bytes) {
  static const char digits[] = "0123456789abcdef";
  std::string text;
  for (const uint8_t b : bytes) text += {digits[b >> 4], digits[b & 15]};
  return text;
}

std::vector<uint8_t> FromHex(const std::string& text) {
  std::vector<uint8_t> bytes;
  for (std::size_t i = 0; i + 1 < text.size(); i += 2)
    bytes.push_back(static_cast<uint8_t>(std::stoi(text.substr(i, 2), nullptr, 16)));
  return bytes;
}

/// " name=value,value": floats as their 32 bits, texts as their characters.
struct Printer {
  std::ostringstream out;

  template <class T>
  void operator()(const char* name, std::size_t, const T& field) {
    out << ' ' << name << '=';
    Print(field);
  }

 private:
  void Print(float value) {
    uint32_t bits = 0;
    std::memcpy(&bits, &value, sizeof bits);
    out << bits;
  }
  template <class T>
  std::enable_if_t<std::is_integral_v<T>> Print(T value) {
    out << +value;
  }
  template <class T, std::size_t N>
  void Print(const std::array<T, N>& values) {
    for (std::size_t i = 0; i < N; ++i) {
      if (i > 0) out << ',';
      Print(values[i]);
    }
  }
  template <std::size_t N>
  void Print(const std::array<char, N>& text) {
    for (const char c : Text(text)) out << static_cast<int>(static_cast<uint8_t>(c)) << ',';
  }
};

template <class M>
void PrintLine(const std::vector<uint8_t>& bytes, const M& message) {
  Printer printer;
  M::Visit(message, printer);
  std::cout << Hex(bytes) << ' ' << M::kName << printer.out.str() << '\n';
}

int Make(uint64_t seed, uint64_t count) {
  chase::world::Random random(seed);
  Signing signing(TestKey(), 7);
  FrameWriter plain(1, 191), sealed(42, 1, &signing);
  for (uint64_t i = 0; i < count; ++i)
    testing::WithType(i % testing::kTypes, [&](auto type) {
      auto message = testing::RandomMessage<decltype(type)>(&random);
      FrameWriter& writer = random.Next() % 8 == 0 ? sealed : plain;
      PrintLine(writer.Write(kUtime, message), message);
    });
  return 0;
}

void Again(const Frame& frame) {
  testing::ForEachType([&](auto type) {
    using M = decltype(type);
    const auto message = As<M>(frame);
    if (!message) return;
    FrameWriter writer(frame.system, frame.component);
    std::vector<uint8_t> bytes;
    for (int k = 0; k <= frame.sequence; ++k) bytes = writer.Write(kUtime, *message);
    PrintLine(bytes, *message);
  });
}

int Read() {
  Signing signing(TestKey(), 1);
  FrameReader plain, sealed(&signing);
  std::string line;
  while (std::getline(std::cin, line)) {
    const std::vector<uint8_t> bytes = FromHex(line);
    FrameReader& reader = bytes[0] == 0xFD && bytes[2] == 1 ? sealed : plain;
    const int64_t before = reader.counters().frames;
    reader.Add(kUtime, bytes.data(), bytes.size(), Again);
    if (reader.counters().frames != before + 1) std::cout << "refused\n";
  }
  return 0;
}

}  // namespace

int main(int argc, char** argv) {
  const std::string what = argc > 1 ? argv[1] : "";
  if (what == "make" && argc == 4)
    return Make(std::strtoull(argv[2], nullptr, 10), std::strtoull(argv[3], nullptr, 10));
  if (what == "read") return Read();
  std::fputs("usage: fcu_exchange make SEED COUNT | read\n", stderr);
  return 1;
}
