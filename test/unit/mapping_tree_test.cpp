#include <gtest/gtest.h>
#include <octomap/octomap.h>

#include <filesystem>
#include <fstream>
#include <iterator>
#include <random>
#include <sstream>

#include "services/mapping/occupancy_tree.h"

namespace chase::mapping {
namespace {

TEST(MappingTree, BytesAreReadByOctomap) {
  OccupancyTree tree(0.2);
  std::mt19937 random(1);
  std::uniform_int_distribution<int> cell(-60, 60);
  std::vector<std::pair<Key, bool>> cells;
  for (int i = 0; i < 3000; ++i)
    cells.push_back({{cell(random), cell(random), cell(random)}, i % 3 == 0});
  for (const auto& [key, occupied] : cells) tree.Set(key, occupied);
  int occupied = 0;
  std::istringstream stream(tree.Write(&occupied));
  octomap::OcTree read(0.1);
  ASSERT_TRUE(read.readBinary(stream));
  EXPECT_DOUBLE_EQ(read.getResolution(), 0.2);
  EXPECT_GT(occupied, 900);
  for (int i = static_cast<int>(cells.size()) - 1; i >= 0; --i) {
    const auto& [key, is_occupied] = cells[static_cast<size_t>(i)];
    const auto* node = read.search(0.2 * (key.x + 0.5), 0.2 * (key.y + 0.5), 0.2 * (key.z + 0.5));
    ASSERT_NE(node, nullptr);
    EXPECT_EQ(read.isNodeOccupied(node),
              tree.State(0.2 * Eigen::Vector3d(key.x + 0.5, key.y + 0.5, key.z + 0.5)) == 1);
  }
}

TEST(MappingTree, WritesWhatOctomapWrites) {
  OccupancyTree tree(0.2);
  octomap::OcTree reference(0.2);
  std::mt19937 random(2);
  std::uniform_int_distribution<int> cell(-4, 3);
  for (int i = 0; i < 20000; ++i) {  // few cells, so that octants are pruned and parted again
    const Key key{cell(random), cell(random), cell(random)};
    const bool occupied = random() % 64 == 0;
    tree.Set(key, occupied);
    reference.setNodeValue(0.2 * (key.x + 0.5), 0.2 * (key.y + 0.5), 0.2 * (key.z + 0.5),
                           occupied ? 2.0f : -1.0f);
    if (i % 500 != 0) continue;
    std::ostringstream out;
    ASSERT_TRUE(reference.writeBinaryConst(out));
    int n = 0;
    ASSERT_TRUE(tree.Write(&n) == out.str()) << i;
  }
}

/// Boxes of one state across the borders of bricks, tiles and the middle of the tree: nodes of all
/// levels up to that of a tile are pruned and parted again.
TEST(MappingTree, WritesBoxesAsOctomapDoes) {
  OccupancyTree tree(0.2);
  octomap::OcTree reference(0.2);
  std::mt19937 random(3);
  for (const int edge : {2, 4, 8, 16, 128, 9, 33, 5, 64, 1, 17, 8}) {
    const int shift = edge == 128 ? 0 : static_cast<int>(random() % 100);
    const bool occupied = random() % 3 == 0;
    for (int i = 0; i < edge * edge * edge; ++i) {
      const Key key{shift - edge + i % edge, i / edge % edge - shift, i / edge / edge - edge / 2};
      tree.Set(key, occupied);
      reference.setNodeValue(octomap::OcTreeKey(static_cast<octomap::key_type>(key.x + 32768),
                                                static_cast<octomap::key_type>(key.y + 32768),
                                                static_cast<octomap::key_type>(key.z + 32768)),
                             occupied ? 2.0f : -1.0f);
    }
    std::ostringstream out;
    ASSERT_TRUE(reference.writeBinaryConst(out));
    int n = 0, expected = 0;
    ASSERT_TRUE(tree.Write(&n) == out.str()) << edge;
    for (auto it = reference.begin_leafs(), end = reference.end_leafs(); it != end; ++it)
      if (reference.isNodeOccupied(*it)) expected += 1 << 3 * (16 - it.getDepth());
    ASSERT_EQ(n, expected) << edge;
  }
}

TEST(MappingTree, SavedTileIsWhatOctomapWritesOfIt) {
  OccupancyTree tree(0.2);
  octomap::OcTree reference(0.2);
  std::mt19937 random(4);
  for (int i = 0; i < 4000; ++i) {
    const auto cell = [&] { return static_cast<int>(random() % 16); };
    const Key key{-20 + cell(), 140 + cell(), cell()};  // tile (-1, 1, 0)
    const bool occupied = random() % 8 == 0;
    tree.Set(key, occupied);
    tree.Set({key.x + 1000, key.y, key.z}, true);
    reference.setNodeValue(0.2 * (key.x + 0.5), 0.2 * (key.y + 0.5), 0.2 * (key.z + 0.5),
                           occupied ? 2.0f : -1.0f);
  }
  std::vector<SavedTile> saved;
  tree.Forget({200.0, 30.0, 0.0}, 40.0, &saved);
  ASSERT_EQ(saved.size(), 1u);
  EXPECT_EQ(std::make_tuple(saved[0].x, saved[0].y, saved[0].z), std::make_tuple(-1, 1, 0));
  std::ostringstream out;
  ASSERT_TRUE(reference.writeBinaryConst(out));
  EXPECT_TRUE(saved[0].bytes == out.str());
}

TEST(MappingTree, FarTilesLeaveAndMemoryIsBounded) {
  OccupancyTree tree(0.2);
  std::vector<SavedTile> saved;
  size_t most = 0;
  for (int i = 0; i < 5000; ++i) {  // 1 km along x
    for (int k = 0; k < 20; ++k) tree.Set({i, k, k % 5}, k % 2 == 0);
    if (i % 100 == 0) tree.Forget({0.2 * i, 0.0, 0.0}, 40.0, &saved);
    most = std::max(most, tree.Bytes());
    if (i == 1000) {
      EXPECT_EQ(tree.State({190.1, 0.1, 0.1}), 1);
    }
  }
  EXPECT_EQ(tree.State({10.1, 0.1, 0.1}), -1);
  EXPECT_LT(most, 3u << 20);
  ASSERT_GT(saved.size(), 20u);
  octomap::OcTree tile(0.1);
  std::istringstream stream(saved.front().bytes);
  ASSERT_TRUE(tile.readBinary(stream));
  EXPECT_TRUE(tile.isNodeOccupied(tile.search(0.1, 0.1, 0.1)));
}

TEST(MappingTree, SavedTileHasItsPrunedCells) {
  OccupancyTree tree(0.2);
  for (int i = 0; i < 8; ++i) tree.Set({2 + i % 2, 2 + i / 2 % 2, 2 + i / 4}, true);
  std::vector<SavedTile> saved;
  tree.Forget({1e4, 0.0, 0.0}, 40.0, &saved);
  ASSERT_EQ(saved.size(), 1u);
  octomap::OcTree tile(0.1);
  std::istringstream stream(saved.front().bytes);
  ASSERT_TRUE(tile.readBinary(stream));
  for (int i = 0; i < 8; ++i)
    EXPECT_NE(tile.search(0.5 + 0.2 * (i % 2), 0.5 + 0.2 * (i / 2 % 2), 0.5 + 0.2 * (i / 4)),
              nullptr);
}

TEST(MappingTree, EmptiesCompletely) {
  OccupancyTree tree(0.2);
  tree.Set({5, 5, 5}, true);
  tree.Forget({1e4, 0.0, 0.0}, 40.0, nullptr);
  int occupied = -1;
  tree.Write(&occupied);
  EXPECT_EQ(occupied, 0);
  tree.Set({5, 5, 5}, true);
  tree.Write(&occupied);
  EXPECT_EQ(occupied, 1);
}

std::string Bytes(const std::filesystem::path& file) {
  std::ifstream in(file, std::ios::binary);
  return {std::istreambuf_iterator<char>(in), {}};
}

TEST(MappingTree, OctomapSamplesLoadAndSaveUnchanged) {
  const std::filesystem::path folder = "../shared/data/octomap";
  if (!std::filesystem::exists(folder)) GTEST_SKIP() << "skipped: real recordings not present";
  const std::string bytes = Bytes(folder / "geb079.bt");
  octomap::OcTree tree(0.1);
  std::istringstream in(bytes);
  ASSERT_TRUE(tree.readBinary(in));
  std::ostringstream out;
  ASSERT_TRUE(tree.writeBinaryConst(out));
  EXPECT_EQ(out.str().size(), bytes.size());
  EXPECT_TRUE(out.str() == bytes);

  const auto copy = std::filesystem::path(::testing::TempDir()) / "mapping_tree_test.graph";
  octomap::ScanGraph graph;
  ASSERT_TRUE(graph.readBinary((folder / "spherical_scan.graph").string()));
  graph.writeBinary(copy.string());
  EXPECT_TRUE(Bytes(copy) == Bytes(folder / "spherical_scan.graph"));
  std::filesystem::remove(copy);
}

/// Our octree takes over every cell of the office floor and gives it back.
TEST(MappingTree, OfficeFloorSurvivesOurTree) {
  const std::string file = "../shared/data/octomap/geb079.bt";
  if (!std::filesystem::exists(file)) GTEST_SKIP() << "skipped: real recordings not present";
  octomap::OcTree office(0.1);
  ASSERT_TRUE(office.readBinary(file));
  office.expand();
  OccupancyTree ours(office.getResolution());
  for (auto it = office.begin_leafs(), end = office.end_leafs(); it != end; ++it) {
    const auto key = it.getKey();
    ours.Set({key[0] - 32768, key[1] - 32768, key[2] - 32768}, office.isNodeOccupied(*it));
  }
  int occupied = 0;
  std::istringstream stream(ours.Write(&occupied));
  octomap::OcTree back(0.1);
  ASSERT_TRUE(back.readBinary(stream));
  back.expand();
  EXPECT_EQ(back.getNumLeafNodes(), office.getNumLeafNodes());
  for (auto it = office.begin_leafs(), end = office.end_leafs(); it != end; ++it) {
    const auto* node = back.search(it.getKey());
    ASSERT_NE(node, nullptr);
    ASSERT_EQ(back.isNodeOccupied(node), office.isNodeOccupied(*it));
  }
}

}  // namespace
}  // namespace chase::mapping
