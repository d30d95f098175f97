// PeninStyle: hard-constraint model-predictive tracking on flat outputs in the kind of Penin,
// Giordano, Chaumette, RA-L 2018; a reconstruction, see README.md.

#include <Eigen/Cholesky>
#include <optional>

#include "test/baselines/penin_style/tracking_nlp.h"
#include "test/baselines/registry.h"
#include "test/baselines/tuning.h"

namespace chase::baselines {
namespace {

using Eigen::VectorXd;

constexpr NlpOptions kStop = {200, 1e-5, 1e-4, 1e-3};  // looser ends before sight is regained
constexpr double kAccepted = 0.05;  // violation that a plan may have, in units of d

class PeninStyle : public Rival {
 public:
  PeninStyle(const planning::PlannerConfig& config, const std::array<double, 4>& set)
      : Rival(config) {
    parameters_.weight_distance = set[0];
    parameters_.weight_smooth = set[1];
    parameters_.weight_image = set[2];
    parameters_.margin = set[3];
    parameters_.desired_distance = config.desired_distance;
  }

  planning::PlanResult Plan(const planning::PlanRequest& request) override {
    if (!IsSound(request)) return KeepOrBrake(config_, request, "the request is not finite");
    const Spline spline(request.horizon);
    const VectorXd warm = WarmStart(request, spline);
    const TrackingNlp nlp(parameters_, config_, request, spline, warm);
    const VectorXd x = Minimise(nlp, warm, kStop);
    const double violation = nlp.Violation(x);
    const bool running = request.running.has_value();
    if (violation > kAccepted && (!running || violation >= nlp.Violation(warm)))
      return KeepOrBrake(config_, request, "the constraints cannot be met");
    auto answer = Answer(config_, request, spline.ToPieces(nlp.ToControls(x), request.t0));
    if (violation > kAccepted) answer.reason = "degraded; " + answer.reason;
    return answer;
  }

 private:
  // The running plan, extended at its last velocity; without one the target's path moved to where
  // the drone is. Fitted to the free control points.
  static VectorXd WarmStart(const planning::PlanRequest& request, const Spline& spline) {
    constexpr int kSamples = 51;
    const Pieces running = RunningOf(request);
    const auto fixed = spline.Fixed(request.start);
    Eigen::Matrix<double, kSamples, Spline::kFree> basis;
    Eigen::Matrix<double, kSamples, 3> rest;
    for (int i = 0; i < kSamples; ++i) {
      const double t = spline.duration() * i / (kSamples - 1);
      const Spline::Row row = spline.Basis(t, 0);
      basis.row(i) = row.tail<Spline::kFree>();
      rest.row(i) =
          Guess(request, running, request.t0 + t).transpose() - row.head<Spline::kFixed>() * fixed;
    }
    const Eigen::Matrix<double, Spline::kFree, Spline::kFree> normal =
        basis.transpose() * basis +
        1e-9 * Eigen::Matrix<double, Spline::kFree, Spline::kFree>::Identity();
    const Eigen::Matrix<double, Spline::kFree, 3, Eigen::RowMajor> free =
        normal.ldlt().solve(basis.transpose() * rest);
    return Eigen::Map<const VectorXd>(free.data(), free.size());
  }

  static Eigen::Vector3d Guess(const planning::PlanRequest& request, const Pieces& running,
                               double t) {
    if (running.empty())
      return request.target.Position(t) + request.start.p - request.target.Position(request.t0);
    const double end = EndOf(running);
    if (t <= end) return StateAt(running, t).p;
    const world::State last = StateAt(running, end);
    return last.p + (t - end) * last.v;
  }

  PeninParameters parameters_;
};

const Registration kPenin(
    "penin_style",
    [](const Setup& s) {
      return std::make_unique<PeninStyle>(s.config,
                                          ParameterSet("penin_style", s.parameter_set, s.scenario));
    },
    true, kParameterSets);

}  // namespace
}  // namespace chase::baselines
