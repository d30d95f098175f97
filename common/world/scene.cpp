#include "common/world/scene.h"

#include <yaml-cpp/yaml.h>

#include <Eigen/Cholesky>
#include <Eigen/Eigenvalues>
#include <algorithm>
#include <cmath>
#include <fstream>
#include <set>
#include <sstream>
#include <stdexcept>

namespace chase::world {
namespace {

/// A node with the path to it, for errors.
class Item {
 public:
  Item(const std::string& origin, const YAML::Node& node, std::string path)
      : origin_(&origin), node_(node), path_(std::move(path)) {}

  [[noreturn]] void Fail(const std::string& what) const {
    std::ostringstream text;
    text << *origin_;
    if (node_.IsDefined() && node_.Mark().line >= 0) text << ":" << node_.Mark().line + 1;
    text << ": " << (path_.empty() ? "" : path_ + ": ") << what;
    throw std::runtime_error(text.str());
  }

  bool Has(const char* key) const { return node_[key].IsDefined(); }
  Item operator[](const char* key) const {
    if (!Has(key)) Fail(std::string("missing key '") + key + "'");
    return {*origin_, node_[key], path_.empty() ? key : path_ + "." + key};
  }
  Item At(std::size_t i) const {
    return {*origin_, node_[i], path_ + "[" + std::to_string(i) + "]"};
  }

  /// Length of the list; fails unless it is one of `low` to `high` entries.
  std::size_t Length(std::size_t low, std::size_t high, const std::string& of) const {
    const std::size_t n = node_.IsSequence() ? node_.size() : 0;
    if (!node_.IsSequence() || n < low || n > high)
      Fail((node_.IsSequence() ? "has " + std::to_string(n) + " entries" : "is not a list") +
           ", must be a list of " + std::to_string(low) +
           (high == low ? "" : " to " + std::to_string(high)) + " " + of);
    return n;
  }

  double Number() const {
    double value = 0.0;
    try {
      value = node_.as<double>();
    } catch (const YAML::Exception&) {
      Fail(node_.IsScalar() ? "'" + node_.Scalar() + "' is not a number" : "is not a number");
    }
    if (!std::isfinite(value))
      Fail("'" + node_.Scalar() + "' is not finite, must be a finite number");
    return value;
  }

  Eigen::Vector3d Vector3() const {
    Length(3, 3, "numbers");
    return {At(0).Number(), At(1).Number(), At(2).Number()};
  }

  /// A list of rows, or a map with that list under `coefficients`.
  Eigen::Matrix<double, Eigen::Dynamic, 3> Rows() const {
    if (node_.IsMap()) {
      AllowKeys({"coefficients"});
      return (*this)["coefficients"].Rows();
    }
    const std::size_t n = Length(1, kMaxSceneDegree + 1, "coefficient rows [x, y, z]");
    Eigen::Matrix<double, Eigen::Dynamic, 3> rows(static_cast<Eigen::Index>(n), 3);
    for (std::size_t k = 0; k < n; ++k)
      rows.row(static_cast<Eigen::Index>(k)) = At(k).Vector3().transpose();
    return rows;
  }

  /// 3x3, as three rows or nine numbers. `hint` says what belongs there.
  Eigen::Matrix3d PositiveDefinite(const std::string& hint) const {
    Eigen::Matrix3d m;
    if (node_.IsSequence() && node_.size() == 9)
      for (std::size_t i = 0; i < 9; ++i)
        m(static_cast<int>(i / 3), static_cast<int>(i % 3)) = At(i).Number();
    else {
      Length(3, 3, "rows of 3 numbers");
      for (std::size_t i = 0; i < 3; ++i) m.row(static_cast<int>(i)) = At(i).Vector3().transpose();
    }
    if ((m - m.transpose()).cwiseAbs().maxCoeff() > 1e-9 * m.cwiseAbs().maxCoeff())
      Fail("is not symmetric: transposed entries differ by " +
           Text((m - m.transpose()).cwiseAbs().maxCoeff()) + ", must be equal; " + hint);
    m = 0.5 * (m + m.transpose()).eval();
    const Eigen::LLT<Eigen::Matrix3d> llt(m);
    const Eigen::Vector3d d = Eigen::Matrix3d(llt.matrixL()).diagonal();
    if (llt.info() != Eigen::Success || !(d.minCoeff() > 1e-7 * d.maxCoeff())) {
      const Eigen::Vector3d values =
          Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d>(m, Eigen::EigenvaluesOnly).eigenvalues();
      Fail("is not positive definite: its least eigenvalue is " + Text(values[0]) +
           ", must be above 0 and 1e-14 of the largest; " + hint);
    }
    return m;
  }

  void AllowKeys(const std::set<std::string>& allowed) const {
    if (!node_.IsMap()) Fail("is not a map of keys and values");
    std::set<std::string> seen;
    for (const auto& entry : node_) {
      const Item key(*origin_, entry.first, path_);
      const auto name = entry.first.as<std::string>("");
      if (allowed.count(name) == 0)
        key.Fail("unknown key '" + name + "'; known here: " + List(allowed));
      if (!seen.insert(name).second) key.Fail("'" + name + "' is given twice; keep one of them");
    }
  }

  static std::string List(const std::set<std::string>& keys) {
    std::string list;
    for (const std::string& key : keys) list += (list.empty() ? "" : ", ") + key;
    return list;
  }

  static std::string Text(double value) {
    std::ostringstream text;
    text << value;
    return text.str();
  }

  std::string Text() const {
    YAML::Emitter out;
    out << node_;
    return out.c_str();
  }

 private:
  const std::string* origin_;
  YAML::Node node_;
  std::string path_;
};

State ReadState(const Item& item) {
  item.AllowKeys({"p", "v", "a", "j"});
  State s;
  s.p = item["p"].Vector3();
  if (item.Has("v")) s.v = item["v"].Vector3();
  if (item.Has("a")) s.a = item["a"].Vector3();
  if (item.Has("j")) s.j = item["j"].Vector3();
  return s;
}

Obstacle ReadObstacle(const Item& item, double horizon, int id) {
  item.AllowKeys({"center", "shape"});
  Obstacle o;
  o.id = id;
  o.center = {0.0, horizon, item["center"].Rows()};
  o.moving = o.center.degree() > 0;
  o.shape = item["shape"].PositiveDefinite(
      "for semi-axes a b c along x y z give 1/a^2 1/b^2 1/c^2 on the diagonal");
  return o;
}

Observation ReadObservation(const Item& item) {
  item.AllowKeys({"t", "mean", "covariance"});
  return {item["t"].Number(), item["mean"].Vector3(),
          item["covariance"].PositiveDefinite("give variances in m^2 on the diagonal")};
}

Scene Read(const Item& root) {
  root.AllowKeys({"horizon_s", "initial", "target", "obstacles", "observations", "planner",
                  "predictor", "description"});
  Scene scene;
  scene.horizon_s = root["horizon_s"].Number();
  if (!(scene.horizon_s > 0.0 && scene.horizon_s <= 60.0))
    root["horizon_s"].Fail("is " + Item::Text(scene.horizon_s) +
                           ", must be above 0 and at most 60 s");
  scene.has_initial = root.Has("initial");
  if (scene.has_initial) scene.initial = ReadState(root["initial"]);
  scene.has_target = root.Has("target");
  if (scene.has_target) scene.target = {0.0, scene.horizon_s, root["target"].Rows()};
  if (root.Has("obstacles")) {
    const Item list = root["obstacles"];
    const std::size_t n = list.Length(0, kMaxSceneObstacles, "obstacles");
    for (std::size_t i = 0; i < n; ++i)
      scene.obstacles.push_back(ReadObstacle(list.At(i), scene.horizon_s, static_cast<int>(i)));
  }
  if (root.Has("observations")) {
    const Item list = root["observations"];
    const std::size_t n = list.Length(1, 1000, "observations");
    for (std::size_t i = 0; i < n; ++i) scene.observations.push_back(ReadObservation(list.At(i)));
  }
  if (root.Has("planner")) scene.planner = root["planner"].Text();
  if (root.Has("predictor")) scene.predictor = root["predictor"].Text();
  return scene;
}

[[noreturn]] void FailOnSize(const std::string& origin, std::size_t bytes) {
  throw std::runtime_error(origin + ": obstacles: the file has " + std::to_string(bytes >> 20) +
                           " MiB, must be at most 4 MiB and " + std::to_string(kMaxSceneObstacles) +
                           " obstacles; leave out those that are far away");
}

}  // namespace

Scene ParseScene(const std::string& yaml, const std::string& origin) {
  if (yaml.size() > kMaxSceneBytes) FailOnSize(origin, yaml.size());
  try {
    return Read(Item(origin, YAML::Load(yaml), ""));
  } catch (const YAML::Exception& e) {
    throw std::runtime_error(origin + ":" + std::to_string(e.mark.line + 1) +
                             ": not YAML: " + e.msg);
  }
}

Scene LoadScene(const std::string& file) {
  std::ifstream in(file, std::ios::binary);
  std::string text;
  text.resize(kMaxSceneBytes + 1);
  if (!in || !in.read(text.data(), 0))
    throw std::runtime_error(file + ": cannot be read; give the path of a scene file");
  in.read(text.data(), static_cast<std::streamsize>(text.size()));
  text.resize(static_cast<std::size_t>(std::max<std::streamsize>(0, in.gcount())));
  if (text.size() > kMaxSceneBytes) {
    in.clear();
    in.seekg(0, std::ios::end);
    FailOnSize(file, static_cast<std::size_t>(std::max<std::streamoff>(0, in.tellg())));
  }
  return ParseScene(text, file);
}

}  // namespace chase::world
