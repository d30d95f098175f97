#pragma once

#include <array>
#include <cstdint>
#include <string>
#include <vector>

namespace chase::mapping {

/// What OctoMap's binary stream says of a node, in two bits.
enum class NodeState : uint8_t { kUnknown = 0, kFree = 1, kOccupied = 2, kInner = 3 };

/// Nodes of an octree in the order and format of OctoMap's binary stream (Hornung et al. 2013,
/// Sec. 3.5): of each inner node the states of its eight children, x changing fastest, then what
/// lies below them. A node whose children are all alike and have none themselves is a leaf.
class NodeWriter {
 public:
  /// Appends an inner node. `child(i)` appends what lies below the i-th child and returns its
  /// state. Where the children are all alike nothing is appended and their state is returned.
  template <class Child>
  NodeState Inner(const Child& child) {
    constexpr unsigned kAllFree = 0x5555, kAllOccupied = 0xAAAA;
    const size_t at = bytes_.size();
    bytes_.append(2, '\0');
    unsigned states = 0;
    for (unsigned i = 0; i < 8; ++i) states |= static_cast<unsigned>(child(i)) << 2 * i;
    if (states == 0 || states == kAllFree || states == kAllOccupied) {
      bytes_.resize(at);
      return static_cast<NodeState>(states & 3u);
    }
    Set(at, states);
    return NodeState::kInner;
  }
  /// The same for eight cells, a bit of each byte per cell; occupied cells are known too.
  NodeState Cells(unsigned known, unsigned occupied);

  const std::string& bytes() const { return bytes_; }
  /// Nodes written as children, so all but the root.
  size_t children() const { return children_; }

 private:
  void Set(size_t at, unsigned states);

  std::string bytes_;
  size_t children_ = 0;
};

/// 128^3 cells, each unknown, free or occupied. Kept as bricks of 8^3 cells in Morton order, two
/// bits a cell: a cell is set without a way down a tree, and octants are compared as words.
class OctreeTile {
 public:
  static constexpr int kLevels = 7;  ///< 2^7 cells

  OctreeTile() : brick_(kBricks, 0) {}

  /// Sets a cell; x, y and z count from the tile's corner.
  void Set(unsigned x, unsigned y, unsigned z, bool occupied);
  NodeState State(unsigned x, unsigned y, unsigned z) const;
  int occupied() const { return occupied_; }
  /// Appends the tile's node and what lies below it.
  NodeState Write(NodeWriter* writer) const { return Write(0, kLevels - kBrickLevels, writer); }
  size_t Bytes() const;

 private:
  static constexpr int kBrickLevels = 3;
  static constexpr size_t kBricks = size_t{1} << 3 * (kLevels - kBrickLevels);
  struct Brick {
    std::array<uint64_t, 8> known{}, occupied{};  ///< by Morton number, 64 to a word
  };
  NodeState Write(size_t first, int level, NodeWriter* writer) const;

  std::vector<uint16_t> brick_;  ///< by Morton number: place in bricks_ from 1; 0: nothing known
  std::vector<Brick> bricks_;
  int occupied_ = 0;  ///< cells
};

}  // namespace chase::mapping
