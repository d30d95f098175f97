#include "services/odometry/error_state_filter.h"

#include <Eigen/Cholesky>
#include <cmath>
#include <limits>
#include <vector>

#include "common/math/rotation.h"

namespace chase::odometry {

namespace {

// Logarithms of likelihood ratios, chosen: a match is off once in a minute or two of sweeps; one
// that is off passes for a jump with a probability of 1e-3 at most, a jump for one with 5e-5
// (Wald's bounds, which hold for errors that are independent from match to match).
constexpr double kOff = 7.0, kAccept = 7.0, kReject = -10.0;
constexpr double kOpen = 2.0;    // over what noise alone explains
constexpr int kMostMatches = 4;  // until it is decided

using math::ExpSO3;
using math::Hat;
using math::LogSO3;

/// P <- F P F' for F = I + dt A with A's only blocks (p,v), (v,theta), (v,ba), (v,g), (v,mount),
/// (theta,bg), (theta,mount).
void PropagateCovariance(const Eigen::Matrix3d& R_WB, const Eigen::Matrix3d& R_WI,
                         const Eigen::Vector3d& force_W, const Eigen::Vector3d& w_B, double dt,
                         ErrorCovariance* P) {
  ErrorCovariance F = ErrorCovariance::Identity();
  F.block<3, 3>(kP, kV) = dt * Eigen::Matrix3d::Identity();
  F.block<3, 3>(kV, kTheta) = -dt * Hat(force_W);
  F.block<3, 3>(kV, kAccelBias) = -dt * R_WI;
  F.block<3, 3>(kV, kGravity) = dt * Eigen::Matrix3d::Identity();
  F.block<3, 3>(kV, kMount) = -dt * Hat(force_W) * R_WB;
  F.block<3, 3>(kTheta, kGyroBias) = -dt * R_WI;
  F.block<3, 3>(kTheta, kMount) = -dt * R_WB * Hat(w_B);
  const ErrorCovariance FP = F * *P;
  P->noalias() = FP * F.transpose();
}

void AddDiagonal(int block, double variance, ErrorCovariance* P) {
  for (int i = 0; i < 3; ++i) (*P)(block + i, block + i) += variance;
}

/// An unknown acceleration of size `a` that changes all the while. A constant one over dt would
/// make a velocity learnt from exact positions swing from step to step.
void AddAcceleration(double a, double dt, ErrorCovariance* P) {
  const double v2 = a * a * dt * dt;
  for (int i = 0; i < 3; ++i) {
    (*P)(kP + i, kP + i) += v2 * dt * dt / 3.0;
    (*P)(kV + i, kV + i) += v2;
    (*P)(kP + i, kV + i) += 0.5 * v2 * dt;
    (*P)(kV + i, kP + i) += 0.5 * v2 * dt;
  }
}

using JacobianRows = Eigen::Matrix<double, Eigen::Dynamic, kStates>;

void Symmetrise(ErrorCovariance* P) { *P = (0.5 * (*P + P->transpose())).eval(); }

/// The covariance if the biases have jumped `age` s ago. Sweeps have held place and attitude until
/// `gap` s ago, velocity not yet. To first order a jump (b_g, b_a) turns the body by -R b_g gap,
/// adds the velocity -R b_a age + Hat(force) R b_g gap^2 / 2 and moves it as these do.
ErrorCovariance AfterJump(const NavState& state, double gap, double age) {
  constexpr double kGyro = 0.017, kAccel = 0.2;  // rad/s, m/s^2: offsets of a BMI088, data sheet
  const Eigen::Matrix3d R = state.R_WB.toRotationMatrix();
  const Eigen::Matrix3d turned = Hat(state.a - state.g) * R;
  Eigen::Matrix<double, kStates, 6> effect = Eigen::Matrix<double, kStates, 6>::Zero();
  effect.block<3, 3>(kP, 0) = gap * gap * gap / 6.0 * turned;
  effect.block<3, 3>(kV, 0) = gap * gap / 2.0 * turned;
  effect.block<3, 3>(kTheta, 0) = -gap * R;
  effect.block<3, 3>(kGyroBias, 0).setIdentity();
  effect.block<3, 3>(kP, 3) = -gap * (age - gap / 2.0) * R;
  effect.block<3, 3>(kV, 3) = -age * R;
  effect.block<3, 3>(kAccelBias, 3).setIdentity();
  effect.leftCols<3>() *= kGyro;
  effect.rightCols<3>() *= kAccel;
  return state.P + effect * effect.transpose();
}

/// Of an innovation, up to a constant; minus infinity where its covariance is none.
double LogLikelihood(const Eigen::VectorXd& innovation, const Eigen::MatrixXd& covariance) {
  const Eigen::LDLT<Eigen::MatrixXd> solver(covariance);
  if (solver.info() != Eigen::Success || !(solver.vectorD().minCoeff() > 0.0)) return -HUGE_VAL;
  return -0.5 * (innovation.dot(solver.solve(innovation)) + solver.vectorD().array().log().sum());
}

/// innovation = H dx + noise, linear in the error state.
struct Observation {
  JacobianRows H;
  Eigen::VectorXd innovation;
  Eigen::MatrixXd noise;  // its covariance

  Eigen::MatrixXd InnovationCovariance(const ErrorCovariance& P) const {
    return H * P * H.transpose() + noise;
  }
};

/// Kalman update in Joseph's form; refused where the innovation's covariance is singular or the
/// normalised innovation squared per direction exceeds `largest_nis`. Above `usual_nis` the noise
/// is taken larger by as much: inertia tells a tenth of a second better than a match that is at
/// odds with it, and doubt in the state instead would hand it over to such matches.
UpdateResult Correct(Observation y, double usual_nis, double largest_nis, NavState* state) {
  Eigen::LDLT<Eigen::MatrixXd> solver(y.InnovationCovariance(state->P));
  if (solver.info() != Eigen::Success || !(solver.vectorD().minCoeff() > 0.0)) return {};
  const double k = static_cast<double>(y.innovation.size());
  const double nis = y.innovation.dot(solver.solve(y.innovation)) / k;
  if (!(nis <= largest_nis)) return {false, nis};
  if (nis > usual_nis) {
    y.noise *= nis / usual_nis;
    solver.compute(y.InnovationCovariance(state->P));
  }
  const Eigen::MatrixXd K = solver.solve(y.H * state->P).transpose();
  const ErrorVector dx = K * y.innovation;
  if (!dx.allFinite()) return {};
  Inject(dx, state);
  const ErrorCovariance I_KH = ErrorCovariance::Identity() - K * y.H;
  state->P = (I_KH * state->P * I_KH.transpose() + K * y.noise * K.transpose()).eval();
  Symmetrise(&state->P);
  return {true, nis};
}

/// The largest log-likelihood of an innovation over the hypotheses without a jump: noise alone, or
/// a match that is off by wrong stamps, or by features that were matched with another surface
/// within the gate; along any one direction of place and of attitude, or along all.
double LogLikelihoodWithoutJump(const Observation& y, const ErrorCovariance& P, double gate) {
  constexpr double kTurned = 0.005;  // rad: 20 ms at 0.25 rad/s
  const Eigen::MatrixXd S = y.InnovationCovariance(P);
  const Eigen::Index k = S.rows();
  Eigen::Index places = 0;  // directions that are more of place than of attitude; they come first
  while (places < k && y.H.row(places).segment<3>(kP).squaredNorm() > 0.5) ++places;
  // Variances to be added to the directions [first, first + n): of none, of each, of all.
  const auto offs = [k](Eigen::Index first, Eigen::Index n, double sigma) {
    std::vector<Eigen::VectorXd> all(1, Eigen::VectorXd::Zero(k));
    for (Eigen::Index i = 0; i < n; ++i)
      all.emplace_back(sigma * sigma * Eigen::VectorXd::Unit(k, first + i));
    all.push_back(all.front());
    all.back().segment(first, n).setConstant(sigma * sigma);
    return all;
  };
  double best = LogLikelihood(y.innovation, S);
  for (const double off : {0.02, gate})  // m: 20 ms at 1 m/s; another surface
    for (const Eigen::VectorXd& place : offs(0, places, off))
      for (const Eigen::VectorXd& attitude : offs(places, k - places, kTurned)) {
        const Eigen::MatrixXd wider = S + Eigen::MatrixXd((place + attitude).asDiagonal());
        best = std::max(best, LogLikelihood(y.innovation, wider) - kOff);
      }
  return best;
}

/// Where a jump explains the match far better than noise does, and not much worse than that the
/// match is off. A turn is felt at once, an acceleration by the sweep after.
std::optional<JumpHypothesis> OpenHypothesis(const FilterConfig& config, const Observation& y,
                                             double gap, double otherwise, const NavState& before) {
  const double noise = LogLikelihood(y.innovation, y.InnovationCovariance(before.P));
  double best = std::max(noise + kOpen, otherwise + kReject);
  std::optional<JumpHypothesis> jump;
  for (const double age : {gap, 2.0 * gap}) {
    NavState jumped = before;
    jumped.P = AfterJump(before, gap, age);
    const Eigen::MatrixXd S = y.InnovationCovariance(jumped.P);
    const double likelihood = LogLikelihood(y.innovation, S);
    const double nis = y.innovation.dot(S.ldlt().solve(y.innovation));
    if (!(likelihood > best) ||
        !(nis <= config.usual_nis * static_cast<double>(y.innovation.size())))
      continue;
    best = likelihood;
    jump = JumpHypothesis{jumped, likelihood - otherwise, 1};
  }
  if (jump && !Correct(y, config.usual_nis, config.largest_nis, &jump->state).applied) jump.reset();
  return jump;
}

/// An open hypothesis by one more match, whose innovation to it is that of `y`: the update where it
/// is accepted; dropped where it is not likely, not decided in time or refuses the match.
std::optional<UpdateResult> Weigh(const FilterConfig& config, const Observation& y, double gate,
                                  double otherwise, std::optional<JumpHypothesis>* jump) {
  JumpHypothesis& h = **jump;
  h.log_likelihood_ratio += LogLikelihoodWithoutJump(y, h.state.P, gate) - otherwise;
  ++h.matches;
  const UpdateResult result = Correct(y, config.usual_nis, config.largest_nis, &h.state);
  if (h.log_likelihood_ratio > kAccept && result.applied && result.nis <= config.usual_nis)
    return result;
  if (h.log_likelihood_ratio < kReject || h.matches >= kMostMatches || !result.applied)
    jump->reset();
  return std::nullopt;
}

/// What the unknown directions U, left at the prediction, do to the known ones V of a match: an
/// error e there moves these by -(V' H V)^-1 V' H U e.
Eigen::MatrixXd FromUnknown(const PoseMeasurement& z, const Eigen::LDLT<Eigen::MatrixXd>& known,
                            const NavState& state) {
  Eigen::Matrix<double, 6, 6> P, unknown = Eigen::Matrix<double, 6, 6>::Identity();
  P << state.P.block<3, 3>(kP, kP), state.P.block<3, 3>(kP, kTheta),
      state.P.block<3, 3>(kTheta, kP), state.P.block<3, 3>(kTheta, kTheta);
  unknown -= z.known * z.known.transpose();
  const Eigen::MatrixXd moves = known.solve(z.known.transpose() * z.information * unknown);
  return moves * P * moves.transpose();
}

}  // namespace

void Propagate(const FilterConfig& config, const ImuSample& imu, NavState* state) {
  const double dt = imu.t - state->t, length = std::abs(dt);
  if (!(length > 0.0)) return;
  const Eigen::Quaterniond R_BI = ExpSO3(state->mount);
  const Eigen::Vector3d w = R_BI * (imu.gyro - state->gyro_bias);
  const Eigen::Quaterniond middle = state->R_WB * ExpSO3(0.5 * dt * w);
  const Eigen::Vector3d force_W = middle * R_BI * (imu.accel - state->accel_bias);
  const Eigen::Vector3d a = force_W + state->g;
  PropagateCovariance(middle.toRotationMatrix(), (middle * R_BI).toRotationMatrix(), force_W, w, dt,
                      &state->P);
  AddDiagonal(kV, config.accel_noise * config.accel_noise * length, &state->P);
  AddDiagonal(kTheta, config.gyro_noise * config.gyro_noise * length, &state->P);
  AddDiagonal(kGyroBias, config.gyro_bias_walk * config.gyro_bias_walk * length, &state->P);
  AddDiagonal(kAccelBias, config.accel_bias_walk * config.accel_bias_walk * length, &state->P);
  state->p += dt * state->v + 0.5 * dt * dt * a;
  state->v += dt * a;
  state->R_WB = (state->R_WB * ExpSO3(dt * w)).normalized();
  state->w_B = w;
  state->a = a;
  state->t = imu.t;
}

void AddUnsampled(const FilterConfig& config, const ImuSample& from, const ImuSample& to, double dt,
                  NavState* state) {
  const auto variance = [&](const Eigen::Vector3d& change, double noise) {
    const double unexplained = change.squaredNorm() / 3.0 - 2.0 * noise * noise / dt;
    return dt * dt / 12.0 * std::max(0.0, unexplained);
  };
  if (!(dt > 0.0)) return;
  AddDiagonal(kV, variance(to.accel - from.accel, config.accel_noise), &state->P);
  AddDiagonal(kTheta, variance(to.gyro - from.gyro, config.gyro_noise), &state->P);
}

void PropagateBlind(const FilterConfig& config, double t, NavState* state) {
  const double dt = t - state->t;
  if (!(dt > 0.0)) return;
  state->p += dt * state->v;
  state->R_WB = (state->R_WB * ExpSO3(dt * state->w_B)).normalized();
  state->a.setZero();
  ErrorCovariance F = ErrorCovariance::Identity();
  F.block<3, 3>(kP, kV) = dt * Eigen::Matrix3d::Identity();
  state->P = (F * state->P * F.transpose()).eval();
  AddAcceleration(config.blind_accel, dt, &state->P);
  AddDiagonal(kTheta, config.blind_rate * config.blind_rate * dt * dt, &state->P);
  state->t = t;
}

void Doubt(const FilterConfig& config, double gap, NavState* state) {
  AddAcceleration(config.doubt_accel, gap, &state->P);
}

void DoubtAcceleration(const FilterConfig& config, const Eigen::Matrix3d& unheld, NavState* state) {
  if (unheld.trace() < 0.5) return;
  const Eigen::Matrix3d R = state->R_WB.toRotationMatrix();
  Eigen::Matrix<double, 3, kStates> J = Eigen::Matrix<double, 3, kStates>::Zero();  // of a
  J.block<3, 3>(0, kTheta) = -Hat(state->a - state->g);
  J.block<3, 3>(0, kAccelBias) = -R;
  J.block<3, 3>(0, kGravity).setIdentity();
  J.block<3, 3>(0, kMount) = -Hat(state->a - state->g) * R;
  const double known2 = (unheld * J * state->P * J.transpose() * unheld).trace() / unheld.trace();
  const double lacking2 = std::pow(config.map_tilt * config.gravity, 2) - known2;
  if (lacking2 > 0.0)
    state->P.block<3, 3>(kAccelBias, kAccelBias) += lacking2 * R.transpose() * unheld * R;
}

void Inject(const ErrorVector& dx, NavState* state) {
  state->p += dx.segment<3>(kP);
  state->v += dx.segment<3>(kV);
  state->R_WB = (ExpSO3(dx.segment<3>(kTheta)) * state->R_WB).normalized();
  state->gyro_bias += dx.segment<3>(kGyroBias);
  state->accel_bias += dx.segment<3>(kAccelBias);
  state->g += dx.segment<3>(kGravity);
  state->mount += dx.segment<3>(kMount);
}

UpdateResult Update(const FilterConfig& config, const PoseMeasurement& z, double gap,
                    NavState* state, std::optional<JumpHypothesis>* jump) {
  const auto& V = z.known;
  const Eigen::Index k = V.cols();
  if (k == 0) return {};
  // The floor is for what features have in common. Where the map itself is wrong no update can
  // tell: MapDrift adds that to what is put out.
  const Eigen::MatrixXd reduced = V.transpose() * z.information * V;
  Eigen::Matrix<double, 6, 1> floor;
  floor << Eigen::Vector3d::Constant(config.match_position_floor),
      Eigen::Vector3d::Constant(config.match_rotation_floor);
  const Eigen::LDLT<Eigen::MatrixXd> information(reduced);
  if (information.info() != Eigen::Success || !(information.vectorD().minCoeff() > 0.0)) return {};
  const Eigen::MatrixXd onto = (V.transpose() * V).ldlt().solve(V.transpose());  // V onto = proj.
  const auto innovation = [&](const NavState& from) {
    Eigen::Matrix<double, 6, 1> e;
    e << z.X_WB.p - from.p, LogSO3(z.X_WB.R * from.R_WB.conjugate());
    return Eigen::VectorXd(onto * e);
  };
  Observation y{JacobianRows::Zero(k, kStates), innovation(*state),
                information.solve(Eigen::MatrixXd::Identity(k, k)) +
                    onto * floor.cwiseAbs2().asDiagonal() * onto.transpose() +
                    FromUnknown(z, information, *state)};
  y.H.middleCols<3>(kP) = onto.leftCols<3>();
  y.H.middleCols<3>(kTheta) = onto.rightCols<3>();
  if (!jump) return Correct(y, config.usual_nis, config.largest_nis, state);

  const double otherwise = LogLikelihoodWithoutJump(y, state->P, z.gate);
  const bool weighed = jump->has_value();
  if (weighed) {
    Observation of_jump = y;
    of_jump.innovation = innovation((*jump)->state);
    if (const auto accepted = Weigh(config, of_jump, z.gate, otherwise, jump)) {
      *state = (*jump)->state;
      jump->reset();
      return *accepted;
    }
  }
  if (!weighed && gap > 0.0) *jump = OpenHypothesis(config, y, gap, otherwise, *state);
  return Correct(y, config.usual_nis, config.largest_nis, state);
}

void HoldStill(const Eigen::Vector3d& gyro, NavState* state) {
  constexpr double kSpeed = 3e-3, kTurn = 1e-3;  // m/s and rad/s
  JacobianRows H = JacobianRows::Zero(6, kStates);
  H.block<3, 3>(0, kV).setIdentity();
  H.block<3, 3>(3, kGyroBias).setIdentity();
  Eigen::VectorXd innovation(6), sigma(6);
  innovation << -state->v, gyro - state->gyro_bias;
  sigma << Eigen::Vector3d::Constant(kSpeed), Eigen::Vector3d::Constant(kTurn);
  constexpr double kAny = std::numeric_limits<double>::infinity();
  Correct({H, innovation, sigma.cwiseAbs2().asDiagonal()}, kAny, kAny, state);
}

}  // namespace chase::odometry
