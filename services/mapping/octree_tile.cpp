#include "services/mapping/octree_tile.h"

namespace chase::mapping {

namespace {

constexpr uint64_t kAll = ~uint64_t{0};

/// Puts zeros between the bits: one for pairs, two for Morton numbers of three coordinates.
constexpr uint32_t Spread(unsigned bits, int gap) {
  uint32_t spread = 0;
  for (int i = 0; i < 8; ++i) spread |= ((bits >> i) & 1u) << (gap + 1) * i;
  return spread;
}

template <int kGap>
constexpr std::array<uint32_t, 256> SpreadTable() {
  std::array<uint32_t, 256> table{};
  for (unsigned i = 0; i < 256; ++i) table[i] = Spread(i, kGap);
  return table;
}

constexpr auto kPairs = SpreadTable<1>();
constexpr auto kTriples = SpreadTable<2>();

unsigned Morton(unsigned x, unsigned y, unsigned z) {
  return kTriples[x] | kTriples[y] << 1 | kTriples[z] << 2;
}

unsigned Byte(uint64_t word, unsigned i) { return static_cast<unsigned>(word >> 8 * i) & 0xFFu; }

/// A node of 4^3 cells.
NodeState WriteWord(uint64_t known, uint64_t occupied, NodeWriter* writer) {
  if (known == 0) return NodeState::kUnknown;
  if (known == kAll && occupied == 0) return NodeState::kFree;
  return writer->Inner(
      [&](unsigned i) { return writer->Cells(Byte(known, i), Byte(occupied, i)); });
}

}  // namespace

void NodeWriter::Set(size_t at, unsigned states) {
  bytes_[at] = static_cast<char>(states & 0xFFu);
  bytes_[at + 1] = static_cast<char>(states >> 8);
  children_ += static_cast<size_t>(__builtin_popcount((states | states >> 1) & 0x5555u));
}

NodeState NodeWriter::Cells(unsigned known, unsigned occupied) {
  if (known == 0) return NodeState::kUnknown;
  if (known == 0xFF && occupied == 0) return NodeState::kFree;
  if (occupied == 0xFF) return NodeState::kOccupied;
  bytes_.append(2, '\0');
  Set(bytes_.size() - 2, kPairs[known & ~occupied] | kPairs[occupied] << 1);
  return NodeState::kInner;
}

void OctreeTile::Set(unsigned x, unsigned y, unsigned z, bool occupied) {
  const unsigned cell = Morton(x, y, z);
  uint16_t& place = brick_[cell >> 3 * kBrickLevels];
  if (place == 0) {
    bricks_.emplace_back();
    place = static_cast<uint16_t>(bricks_.size());
  }
  Brick& brick = bricks_[place - 1u];
  const size_t word = (cell >> 6) & 7u;
  const uint64_t bit = uint64_t{1} << (cell & 63u);
  const bool was = brick.occupied[word] & bit;
  occupied_ += static_cast<int>(occupied) - static_cast<int>(was);
  brick.known[word] |= bit;
  if (occupied)
    brick.occupied[word] |= bit;
  else
    brick.occupied[word] &= ~bit;
}

NodeState OctreeTile::State(unsigned x, unsigned y, unsigned z) const {
  const unsigned cell = Morton(x, y, z);
  const uint16_t place = brick_[cell >> 3 * kBrickLevels];
  if (place == 0) return NodeState::kUnknown;
  const Brick& brick = bricks_[place - 1u];
  const size_t word = (cell >> 6) & 7u;
  if (!(brick.known[word] >> (cell & 63u) & 1u)) return NodeState::kUnknown;
  return brick.occupied[word] >> (cell & 63u) & 1u ? NodeState::kOccupied : NodeState::kFree;
}

/// The node of 8^level bricks that starts with brick `first`.
NodeState OctreeTile::Write(size_t first, int level, NodeWriter* writer) const {
  if (level > 0)
    return writer->Inner([&](unsigned i) {
      return Write(first + (size_t{i} << 3 * (level - 1)), level - 1, writer);
    });
  if (brick_[first] == 0) return NodeState::kUnknown;
  const Brick& brick = bricks_[brick_[first] - 1u];
  return writer->Inner(
      [&](unsigned i) { return WriteWord(brick.known[i], brick.occupied[i], writer); });
}

size_t OctreeTile::Bytes() const {
  return sizeof(*this) + brick_.capacity() * sizeof(uint16_t) + bricks_.capacity() * sizeof(Brick);
}

}  // namespace chase::mapping
