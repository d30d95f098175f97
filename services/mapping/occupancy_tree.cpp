#include "services/mapping/occupancy_tree.h"

#include <algorithm>
#include <sstream>

namespace chase::mapping {

namespace {

constexpr int kMiddle = 32768;   // OctoMap's key of the cell that starts at zero
constexpr int kTreeLevels = 16;  // OctoMap's
constexpr int kUpper = kTreeLevels - OctreeTile::kLevels;  // levels above the tiles

struct NumberedTile {
  uint32_t morton;
  const OctreeTile* tile;
};
using TileRange = std::pair<const NumberedTile*, const NumberedTile*>;

bool InTree(const Key& key) {
  const auto in = [](int k) { return k >= -kMiddle && k < kMiddle; };
  return in(key.x) && in(key.y) && in(key.z);
}

std::tuple<int, int, int> TileOf(const Key& key) {
  constexpr int kLevels = OctreeTile::kLevels;
  return {key.x >> kLevels, key.y >> kLevels, key.z >> kLevels};
}

/// The cell's place in its tile.
unsigned Within(int k) { return static_cast<unsigned>(k) & (OccupancyTree::kTileCells - 1u); }

NumberedTile Numbered(const std::tuple<int, int, int>& key, const OctreeTile& tile) {
  const auto [x, y, z] = key;
  uint32_t morton = 0;
  for (int i = 0; i < kUpper; ++i) {
    int axis = 0;
    for (const int k : {x, y, z})
      morton |= (static_cast<uint32_t>(k + (kMiddle >> OctreeTile::kLevels)) >> i & 1u)
                << (3 * i + axis++);
  }
  return {morton, &tile};
}

/// The node of 8^level tiles that holds those of the range, which is in Morton order.
NodeState Write(TileRange tiles, int level, NodeWriter* writer) {
  if (tiles.first == tiles.second) return NodeState::kUnknown;
  if (level == 0) return tiles.first->tile->Write(writer);
  const NumberedTile* next = tiles.first;
  return writer->Inner([&](unsigned i) {
    const NumberedTile* first = next;
    while (next != tiles.second && (next->morton >> 3 * (level - 1) & 7u) == i) ++next;
    return Write({first, next}, level - 1, writer);
  });
}

/// All nodes of the octree that holds these tiles and nothing else.
NodeWriter Nodes(std::vector<NumberedTile> tiles) {
  std::sort(tiles.begin(), tiles.end(),
            [](const NumberedTile& a, const NumberedTile& b) { return a.morton < b.morton; });
  NodeWriter writer;
  Write({tiles.data(), tiles.data() + tiles.size()}, kUpper, &writer);
  return writer;
}

/// OctoMap's "bt" stream with its header.
std::string ToBytes(const NodeWriter& nodes, double resolution) {
  std::ostringstream head;
  head
      << "# Octomap OcTree binary file\n# (feel free to add / change comments, but leave the first "
         "line as it is!)\n#\nid OcTree\nsize "
      << nodes.children() + (nodes.bytes().empty() ? 0 : 1) << "\nres " << resolution << "\ndata\n";
  return head.str() + nodes.bytes();
}

}  // namespace

void OccupancyTree::Set(const Key& key, bool occupied) {
  if (!InTree(key)) return;
  const TileKey tile = TileOf(key);
  if (last_.second == nullptr || last_.first != tile) last_ = {tile, &tiles_[tile]};
  last_.second->Set(Within(key.x), Within(key.y), Within(key.z), occupied);
}

void OccupancyTree::Forget(const Eigen::Vector3d& p, double radius, std::vector<SavedTile>* saved) {
  const double edge = kTileCells * resolution_;
  for (auto it = tiles_.begin(); it != tiles_.end();) {
    const auto [x, y, z] = it->first;
    const Eigen::Vector2d center(edge * (x + 0.5), edge * (y + 0.5));
    if ((center - p.head<2>()).norm() <= radius + 0.5 * edge) {
      ++it;
      continue;
    }
    if (saved)
      saved->push_back({x, y, z, ToBytes(Nodes({Numbered(it->first, it->second)}), resolution_)});
    last_.second = nullptr;
    it = tiles_.erase(it);
  }
}

std::string OccupancyTree::Write(int* occupied) const {
  std::vector<NumberedTile> tiles;
  *occupied = 0;
  for (const auto& [key, tile] : tiles_) {
    tiles.push_back(Numbered(key, tile));
    *occupied += tile.occupied();
  }
  return ToBytes(Nodes(std::move(tiles)), resolution_);
}

int OccupancyTree::State(const Eigen::Vector3d& p) const {
  const Eigen::Array3d cell = (p.array() / resolution_).floor().max(-1e9).min(1e9);
  const Key key{static_cast<int>(cell.x()), static_cast<int>(cell.y()), static_cast<int>(cell.z())};
  const auto tile = tiles_.find(TileOf(key));
  if (tile == tiles_.end()) return -1;
  const auto state = tile->second.State(Within(key.x), Within(key.y), Within(key.z));
  return state == NodeState::kUnknown ? -1 : state == NodeState::kOccupied ? 1 : 0;
}

size_t OccupancyTree::Bytes() const {
  size_t sum = 0;
  for (const auto& [key, tile] : tiles_) sum += sizeof(key) + tile.Bytes();
  return sum;
}

}  // namespace chase::mapping
