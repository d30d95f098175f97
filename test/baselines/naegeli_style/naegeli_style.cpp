// NaegeliStyle: model-predictive framing with soft visibility in the kind of Naegeli, Alonso-Mora,
// Domahidi, Rus, Hilliges, RA-L 2017; a reconstruction, see README.md.

#include "test/baselines/naegeli_style/framing_nlp.h"
#include "test/baselines/registry.h"
#include "test/baselines/tuning.h"

namespace chase::baselines {
namespace {

using Eigen::VectorXd;

constexpr double kAccepted = 0.05;

class NaegeliStyle : public Rival {
 public:
  NaegeliStyle(const planning::PlannerConfig& config, const std::array<double, 4>& set)
      : Rival(config) {
    parameters_.weight_distance = set[0];
    parameters_.weight_sight = set[1];
    parameters_.weight_potential = set[2];
    parameters_.weight_effort = set[3];
    parameters_.desired_distance = config.desired_distance;
  }

  planning::PlanResult Plan(const planning::PlanRequest& request) override {
    if (!IsSound(request)) return KeepOrBrake(config_, request, "the request is not finite");
    const VectorXd warm = WarmStart(request);
    const FramingNlp nlp(parameters_, config_, request, warm);
    const VectorXd x = Minimise(nlp, warm, {});
    const double violation = nlp.HardViolation(x);
    if (violation > kAccepted && (!request.running || violation >= nlp.HardViolation(warm)))
      return KeepOrBrake(config_, request, "the constraints cannot be met");
    auto answer = Answer(config_, request, nlp.ToPieces(x));
    if (violation > kAccepted) answer.reason = "degraded; " + answer.reason;
    return answer;
  }

 private:
  // Accelerations of the running plan, none after its end; without one those of the target's path.
  VectorXd WarmStart(const planning::PlanRequest& request) const {
    const Pieces running = RunningOf(request);
    const double step = request.horizon / parameters_.stages;
    VectorXd x = VectorXd::Zero(3 * parameters_.stages + 1);
    for (int k = 0; k < parameters_.stages; ++k) {
      const double t = request.t0 + (k + 0.5) * step;
      x.segment<3>(3 * k) =
          running.empty() ? request.target.Acceleration(t) : StateAt(running, t).a;
    }
    return x;
  }

  NaegeliParameters parameters_;
};

const Registration kNaegeli(
    "naegeli_style",
    [](const Setup& s) {
      return std::make_unique<NaegeliStyle>(
          s.config, ParameterSet("naegeli_style", s.parameter_set, s.scenario));
    },
    true, kParameterSets);

}  // namespace
}  // namespace chase::baselines
