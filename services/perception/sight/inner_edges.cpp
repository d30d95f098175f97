#include <algorithm>
#include <cmath>
#include <opencv2/imgproc.hpp>

#include "services/perception/sight/silhouette.h"

namespace chase::perception {

namespace {

constexpr int kLeastStep = 11;         // grey levels across an edge
constexpr int kSobelGain = 4;          // what a step of one grey level gives
constexpr int kAside = 3;              // px beside an edge where the shading is smooth
constexpr size_t kLeastLength = 10;    // rows of an edge
constexpr int kGap = 2;                // rows from one of its peaks to the next at most
constexpr double kLean = 1.6;          // px, likewise
constexpr size_t kMostEdges = 4;       // the clearest of a blob
constexpr double kClearLength = 30.0;  // rows that make an edge no clearer
constexpr int kBorder = 2;             // px from the blob's own outline that hold no inner edge
constexpr int kBeyond = 2;             // rows of a piece beyond its edges
constexpr double kAlongside = 0.5;     // share of the shorter edge that two of a piece run together

/// An edge from row to row, in the coordinates of the blob's box.
struct Edge {
  std::vector<Eigen::Vector2d> px;  ///< one a row, downwards
  double steps = 0.0;               ///< sum over the rows

  int top() const { return static_cast<int>(px.front().y()); }
  int bottom() const { return static_cast<int>(px.back().y()); }
  double Clearness() const {
    const auto n = static_cast<double>(px.size());
    return steps / n * std::min(n, kClearLength);
  }
  /// Column at a row, carried on straight up and down.
  double At(int row) const {
    const auto after =
        std::lower_bound(px.begin(), px.end(), row, [](const auto& p, int y) { return p.y() < y; });
    return after == px.end() ? px.back().x() : after->x();
  }
};

/// Steps from pixel to pixel along the rows, where the blob and its near neighbours cover them.
cv::Mat Steps(const cv::Mat& bgr, const Detection& d) {
  cv::Mat grey, steps, inside;
  cv::transform(bgr(d.mask_box), grey, cv::Matx13f(0.0f, 0.5f, 0.5f));
  cv::Sobel(grey, steps, CV_16S, 1, 0);
  const cv::Mat line = cv::Mat::ones(1, 2 * kBorder + 1, CV_8U);
  cv::erode(d.mask, inside, line, {-1, -1}, 1, cv::BORDER_CONSTANT, cv::Scalar(0));
  cv::Mat out = cv::Mat::zeros(steps.size(), CV_16S);
  steps.copyTo(out, inside);
  return out;
}

/// Where a row steps up or down at once, more than the shading of a round side; else nothing.
std::optional<Eigen::Vector2d> Peak(const cv::Mat& steps, int x, int y) {
  const auto step = [&](int column) { return std::abs(steps.at<int16_t>(y, column)); };
  const int at = step(x), before = step(x - 1), after = step(x + 1);
  if (at < before || at <= after) return std::nullopt;
  const int slope = std::max(step(x - kAside), step(x + kAside));
  if (at - slope < kSobelGain * kLeastStep) return std::nullopt;
  const double curve = before - 2.0 * at + after;
  return Eigen::Vector2d(x + (curve < 0.0 ? 0.5 * (before - after) / curve : 0.0), y);
}

/// Peaks joined from row to row.
std::vector<Edge> Joined(const cv::Mat& steps) {
  std::vector<Edge> edges;
  for (int y = 0; y < steps.rows; ++y)
    for (int x = kAside; x + kAside < steps.cols; ++x) {
      const auto px = Peak(steps, x, y);
      if (!px) continue;
      const auto joins = [&](const Edge& e) {
        return y > e.bottom() && y - e.bottom() <= kGap &&
               std::abs(px->x() - e.px.back().x()) < kLean;
      };
      auto edge = std::find_if(edges.begin(), edges.end(), joins);
      if (edge == edges.end()) edge = edges.insert(edges.end(), Edge());
      edge->px.push_back(*px);
      edge->steps += std::abs(steps.at<int16_t>(y, x));
    }
  return edges;
}

/// The clearest edges, from left to right.
std::vector<Edge> InnerEdges(const cv::Mat& steps) {
  auto edges = Joined(steps);
  edges.erase(std::remove_if(edges.begin(), edges.end(),
                             [](const Edge& e) { return e.px.size() < kLeastLength; }),
              edges.end());
  std::stable_sort(edges.begin(), edges.end(),
                   [](const Edge& a, const Edge& b) { return a.Clearness() > b.Clearness(); });
  if (edges.size() > kMostEdges) edges.resize(kMostEdges);
  std::stable_sort(edges.begin(), edges.end(),
                   [](const Edge& a, const Edge& b) { return a.px[0].x() < b.px[0].x(); });
  return edges;
}

/// True where two edges run side by side far enough apart.
bool Alongside(const Edge& left, const Edge& right) {
  const int top = std::max(left.top(), right.top()), end = std::min(left.bottom(), right.bottom());
  const int shorter = std::min(left.bottom() - left.top(), right.bottom() - right.top());
  if (end - top < kAlongside * shorter) return false;
  return right.At((top + end) / 2) - left.At((top + end) / 2) >= kLeastPiece;
}

void AddSamples(const Edge& edge, const cv::Point& origin, int top, int bottom, Side side,
                Detection* out) {
  auto& samples = out->silhouette.samples[side];
  samples.clear();
  const size_t stride = 1 + edge.px.size() / kMaxSamples;
  for (size_t i = stride / 2; i < edge.px.size(); i += stride)
    if (edge.px[i].y() >= top && edge.px[i].y() <= bottom)
      samples.emplace_back(edge.px[i].x() + origin.x, edge.px[i].y() + origin.y);
  out->cut[side] = out->goes_on[side] = samples.empty();
}

/// True where the blob lies across an edge carried on straight to this row.
bool Across(const cv::Mat& mask, const Edge& edge, bool is_left, int row) {
  const int column = static_cast<int>(std::ceil(edge.At(row))) + (is_left ? -kBorder - 1 : kBorder);
  return column >= 0 && column < mask.cols && mask.at<uint8_t>(row, column) != 0;
}

/// Rows of a piece between edges: those of either, a few beyond, and more while the blob ends where
/// the edges would go on. Null: the blob's own outline.
std::pair<int, int> RowsOf(const cv::Mat& mask, const Edge* left, const Edge* right) {
  const Edge &a = left ? *left : *right, &b = right ? *right : *left;
  int top = std::max(0, std::min(a.top(), b.top()) - kBeyond);
  int bottom = std::min(mask.rows - 1, std::max(a.bottom(), b.bottom()) + kBeyond);
  const auto ends = [&](int row) {
    return !(left && Across(mask, *left, true, row)) &&
           !(right && Across(mask, *right, false, row));
  };
  while (top > 0 && ends(top - 1)) --top;
  while (bottom + 1 < mask.rows && ends(bottom + 1)) ++bottom;
  return {top, bottom};
}

/// A cap of a piece in whose middle the blob goes on, at row `beyond` of its mask.
void CutCap(const Detection& whole, const cv::Rect& tight, int beyond, Side side, Detection* out) {
  if (beyond < 0 || beyond >= whole.mask.rows) return;
  const int quarter = tight.width / 4;
  const cv::Mat row = whole.mask.row(beyond).colRange(tight.x + quarter, tight.br().x - quarter);
  if (cv::countNonZero(row) == 0) return;
  out->silhouette.samples[side].clear();
  out->cut[side] = out->goes_on[side] = true;
}

/// The blob between two edges; null: up to its own outline.
std::optional<Detection> Between(const cv::Mat& bgr, const Detection& whole, const Edge* left,
                                 const Edge* right, int top, int bottom) {
  cv::Mat mask(whole.mask.size(), CV_8U, cv::Scalar(0));
  for (int y = top; y <= bottom; ++y) {
    const int from = left ? static_cast<int>(std::ceil(left->At(y))) : 0;
    const int to = right ? static_cast<int>(std::ceil(right->At(y))) : mask.cols;
    if (to <= from) continue;
    const cv::Rect run(from, y, to - from, 1);
    whole.mask(run).copyTo(mask(run));
  }
  const cv::Rect tight = cv::boundingRect(mask);
  if (tight.width < kLeastPiece || tight.height < static_cast<int>(kLeastLength))
    return std::nullopt;
  Detection piece = whole;
  piece.mask = mask;
  auto out = *CropTo(bgr, piece, whole.mask_box);
  if (tight.y == top) CutCap(whole, tight, top - 1, kTop, &out);
  if (tight.br().y == bottom + 1) CutCap(whole, tight, bottom + 1, kBottom, &out);
  const cv::Point origin = whole.mask_box.tl();
  if (left) AddSamples(*left, origin, tight.y, tight.br().y - 1, kLeft, &out);
  if (right) AddSamples(*right, origin, tight.y, tight.br().y - 1, kRight, &out);
  out.parted = out.goes_on;
  out.edged = true;
  return out;
}

}  // namespace

std::vector<Detection> SplitAtEdges(const cv::Mat& bgr, const Detection& detection) {
  std::vector<Detection> pieces;
  const auto edges = InnerEdges(Steps(bgr, detection));
  const auto add_rows = [&](const Edge* left, const Edge* right, int top, int bottom) {
    auto piece = Between(bgr, detection, left, right, top, bottom);
    if (piece) pieces.push_back(std::move(*piece));
  };
  const auto add = [&](const Edge* left, const Edge* right) {
    const auto [top, bottom] = RowsOf(detection.mask, left, right);
    const int last = detection.mask.rows - 1;
    add_rows(left, right, top, bottom);
    if (top > 0 || bottom < last) add_rows(left, right, 0, last);  // it may fade
  };
  for (size_t a = 0; a < edges.size(); ++a) {
    add(nullptr, &edges[a]);
    add(&edges[a], nullptr);
    for (size_t b = a + 1; b < edges.size(); ++b)
      if (Alongside(edges[a], edges[b])) add(&edges[a], &edges[b]);
  }
  return pieces;
}

}  // namespace chase::perception
