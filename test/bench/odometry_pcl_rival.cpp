#include "test/bench/odometry_pcl_rival.h"

#include <pcl/filters/voxel_grid.h>
#include <pcl/point_cloud.h>
#include <pcl/point_types.h>
#include <pcl/registration/gicp.h>

namespace chase::odometry::rival {

namespace {

using Cloud = pcl::PointCloud<pcl::PointXYZ>;

Cloud::Ptr Filtered(const std::vector<Eigen::Vector3f>& points, double voxel) {
  Cloud::Ptr cloud(new Cloud), out(new Cloud);
  for (const auto& p : points) cloud->push_back({p.x(), p.y(), p.z()});
  pcl::VoxelGrid<pcl::PointXYZ> filter;
  filter.setInputCloud(cloud);
  const float edge = static_cast<float>(voxel);
  filter.setLeafSize(edge, edge, edge);
  filter.filter(*out);
  return out;
}

}  // namespace

Eigen::Isometry3d MatchWithGicp(const std::vector<Eigen::Vector3f>& source,
                                const std::vector<Eigen::Vector3f>& target, double voxel,
                                const Eigen::Isometry3d& guess) {
  pcl::GeneralizedIterativeClosestPoint<pcl::PointXYZ, pcl::PointXYZ> gicp;
  gicp.setInputSource(Filtered(source, voxel));
  gicp.setInputTarget(Filtered(target, voxel));
  gicp.setMaxCorrespondenceDistance(1.0);
  gicp.setMaximumIterations(20);
  Cloud aligned;
  gicp.align(aligned, guess.matrix().cast<float>());
  Eigen::Isometry3d result;
  result.matrix() = gicp.getFinalTransformation().cast<double>();
  return result;
}

}  // namespace chase::odometry::rival
