#pragma once

#include "chase/attitude_setpoint_t.hpp"
#include "chase/camera_image_t.hpp"
#include "chase/channel_status_t.hpp"
#include "chase/command_ack_t.hpp"
#include "chase/command_t.hpp"
#include "chase/event_t.hpp"
#include "chase/flight_state_t.hpp"
#include "chase/geofence_t.hpp"
#include "chase/health_t.hpp"
#include "chase/imu_t.hpp"
#include "chase/input_t.hpp"
#include "chase/lidar_scan_t.hpp"
#include "chase/map_t.hpp"
#include "chase/mover_t.hpp"
#include "chase/obstacle_t.hpp"
#include "chase/obstacles_t.hpp"
#include "chase/plan_t.hpp"
#include "chase/polynomial_t.hpp"
#include "chase/pose_t.hpp"
#include "chase/prediction_t.hpp"
#include "chase/process_health_t.hpp"
#include "chase/proof_t.hpp"
#include "chase/scan_registered_t.hpp"
#include "chase/scenario_t.hpp"
#include "chase/selection_t.hpp"
#include "chase/separation_t.hpp"
#include "chase/stage_status_t.hpp"
#include "chase/status_t.hpp"
#include "chase/target_t.hpp"
#include "chase/tracking_t.hpp"
#include "chase/truth_t.hpp"

/// The fields of every message type in wire order: `v(name, value)` for each. Tools that show,
/// compare or export any message go through these tables.
namespace chase::logs {

template <class V>
void VisitFields(const input_t& m, V& v) {
  v("channel", m.channel);
  v("seq", m.seq);
}

/// What all messages begin with.
template <class M, class V>
void VisitHead(const M& m, V& v) {
  v("utime", m.utime);
  v("seq", m.seq);
  v("sender", m.sender);
  v("vehicle", m.vehicle);
  v("sender_start", m.sender_start);
  v("n_inputs", m.n_inputs);
  v("inputs", m.inputs);
}

template <class V>
void VisitFields(const separation_t& m, V& v) {
  v("from", m.from);
  v("to", m.to);
  v("normal", m.normal);
}

template <class V>
void VisitFields(const proof_t& m, V& v) {
  v("obstacle", m.obstacle);
  v("of", m.of);
  v("from", m.from);
  v("radius", m.radius);
  v("target_radius", m.target_radius);
  v("n_separations", m.n_separations);
  v("separations", m.separations);
}

template <class V>
void VisitFields(const polynomial_t& m, V& v) {
  v("utime", m.utime);
  v("duration", m.duration);
  v("n_coefficients", m.n_coefficients);
  v("coefficients", m.coefficients);
}

template <class V>
void VisitFields(const obstacle_t& m, V& v) {
  v("id", m.id);
  v("kind", m.kind);
  v("center", m.center);
  v("shape", m.shape);
  v("solid", m.solid);
  v("half", m.half);
  v("orientation", m.orientation);
  v("position_covariance", m.position_covariance);
  v("velocity_covariance", m.velocity_covariance);
  v("existence", m.existence);
}

template <class V>
void VisitFields(const mover_t& m, V& v) {
  v("pos", m.pos);
  v("vel", m.vel);
  v("yaw", m.yaw);
}

template <class V>
void VisitFields(const channel_status_t& m, V& v) {
  v("channel", m.channel);
  v("received", m.received);
  v("dropped", m.dropped);
  v("foreign", m.foreign);
  v("malformed", m.malformed);
  v("rate_hz", m.rate_hz);
}

template <class V>
void VisitFields(const stage_status_t& m, V& v) {
  v("name", m.name);
  v("count", m.count);
  v("mean_ms", m.mean_ms);
  v("p50_ms", m.p50_ms);
  v("p99_ms", m.p99_ms);
  v("max_ms", m.max_ms);
}

template <class V>
void VisitFields(const lidar_scan_t& m, V& v) {
  VisitHead(m, v);
  v("size", m.size);
  v("x", m.x);
  v("y", m.y);
  v("z", m.z);
  v("t", m.t);
  v("intensity", m.intensity);
  v("ring", m.ring);
}

template <class V>
void VisitFields(const camera_image_t& m, V& v) {
  VisitHead(m, v);
  v("width", m.width);
  v("height", m.height);
  v("row_stride", m.row_stride);
  v("pixelformat", m.pixelformat);
  v("exposure", m.exposure);
  v("readout", m.readout);
  v("size", m.size);
  v("data", m.data);
}

template <class V>
void VisitFields(const event_t& m, V& v) {
  VisitHead(m, v);
  v("name", m.name);
  v("phase", m.phase);
}

template <class V>
void VisitFields(const imu_t& m, V& v) {
  VisitHead(m, v);
  v("accel", m.accel);
  v("gyro", m.gyro);
}

template <class V>
void VisitFields(const pose_t& m, V& v) {
  VisitHead(m, v);
  v("epoch", m.epoch);
  v("pos", m.pos);
  v("vel", m.vel);
  v("orientation", m.orientation);
  v("rotation_rate", m.rotation_rate);
  v("accel", m.accel);
  v("gyro_bias", m.gyro_bias);
  v("accel_bias", m.accel_bias);
  v("covariance", m.covariance);
  v("local_covariance", m.local_covariance);
  v("health", m.health);
  v("correcting", m.correcting);
  v("reason", m.reason);
}

template <class V>
void VisitFields(const scan_registered_t& m, V& v) {
  VisitHead(m, v);
  v("epoch", m.epoch);
  v("pos", m.pos);
  v("orientation", m.orientation);
  v("health", m.health);
  v("size", m.size);
  v("x", m.x);
  v("y", m.y);
  v("z", m.z);
  v("intensity", m.intensity);
  v("ring", m.ring);
}

template <class V>
void VisitFields(const obstacles_t& m, V& v) {
  VisitHead(m, v);
  v("epoch", m.epoch);
  v("n_obstacles", m.n_obstacles);
  v("n_cut", m.n_cut);
  v("obstacles", m.obstacles);
}

template <class V>
void VisitFields(const map_t& m, V& v) {
  VisitHead(m, v);
  v("epoch", m.epoch);
  v("resolution", m.resolution);
  v("n_occupied", m.n_occupied);
  v("format", m.format);
  v("size", m.size);
  v("data", m.data);
}

template <class V>
void VisitFields(const target_t& m, V& v) {
  VisitHead(m, v);
  v("epoch", m.epoch);
  v("state", m.state);
  v("mean", m.mean);
  v("covariance", m.covariance);
  v("velocity", m.velocity);
  v("velocity_covariance", m.velocity_covariance);
  v("radius", m.radius);
  v("height", m.height);
  v("box_px", m.box_px);
  v("score", m.score);
  v("n_points", m.n_points);
  v("existence", m.existence);
  v("reason", m.reason);
}

template <class V>
void VisitFields(const prediction_t& m, V& v) {
  VisitHead(m, v);
  v("epoch", m.epoch);
  v("verdict", m.verdict);
  v("reason", m.reason);
  v("target", m.target);
  v("covariance", m.covariance);
  v("velocity_covariance", m.velocity_covariance);
  v("radius", m.radius);
  v("height", m.height);
  v("cost", m.cost);
  v("candidates", m.candidates);
  v("checked", m.checked);
  v("trigger", m.trigger);
  v("existence", m.existence);
}

template <class V>
void VisitFields(const plan_t& m, V& v) {
  VisitHead(m, v);
  v("epoch", m.epoch);
  v("verdict", m.verdict);
  v("reason", m.reason);
  v("position", m.position);
  v("n_yaw", m.n_yaw);
  v("yaw", m.yaw);
  v("target", m.target);
  v("cost", m.cost);
  v("generated", m.generated);
  v("checked", m.checked);
  v("feasible", m.feasible);
  v("n_obstacles", m.n_obstacles);
  v("hard_radius", m.hard_radius);
  v("sigmas", m.sigmas);
  v("certified_clearance", m.certified_clearance);
  v("n_proofs", m.n_proofs);
  v("proofs", m.proofs);
  v("stop", m.stop);
  v("n_stop_proofs", m.n_stop_proofs);
  v("stop_proofs", m.stop_proofs);
}

template <class V>
void VisitFields(const attitude_setpoint_t& m, V& v) {
  VisitHead(m, v);
  v("orientation", m.orientation);
  v("body_rate", m.body_rate);
  v("thrust", m.thrust);
  v("motors", m.motors);
}

template <class V>
void VisitFields(const tracking_t& m, V& v) {
  VisitHead(m, v);
  v("epoch", m.epoch);
  v("following", m.following);
  v("plan_seq", m.plan_seq);
  v("error", m.error);
  v("bound", m.bound);
  v("reason", m.reason);
}

template <class V>
void VisitFields(const command_t& m, V& v) {
  VisitHead(m, v);
  v("id", m.id);
  v("kind", m.kind);
  v("n_arguments", m.n_arguments);
  v("arguments", m.arguments);
}

template <class V>
void VisitFields(const command_ack_t& m, V& v) {
  VisitHead(m, v);
  v("command_sender", m.command_sender);
  v("command_start", m.command_start);
  v("id", m.id);
  v("kind", m.kind);
  v("verdict", m.verdict);
  v("reason", m.reason);
}

template <class V>
void VisitFields(const flight_state_t& m, V& v) {
  VisitHead(m, v);
  v("epoch", m.epoch);
  v("state", m.state);
  v("reason", m.reason);
  v("since", m.since);
  v("has_home", m.has_home);
  v("home", m.home);
  v("n_missing", m.n_missing);
  v("missing", m.missing);
}

template <class V>
void VisitFields(const selection_t& m, V& v) {
  VisitHead(m, v);
  v("hue_min", m.hue_min);
  v("hue_max", m.hue_max);
  v("saturation_min", m.saturation_min);
  v("value_min", m.value_min);
  v("aspect", m.aspect);
  v("fill", m.fill);
  v("inset", m.inset);
  v("outline_sigma", m.outline_sigma);
}

template <class V>
void VisitFields(const geofence_t& m, V& v) {
  VisitHead(m, v);
  v("epoch", m.epoch);
  v("n_corners", m.n_corners);
  v("corners", m.corners);
  v("floor", m.floor);
  v("ceiling", m.ceiling);
}

template <class V>
void VisitFields(const process_health_t& m, V& v) {
  v("name", m.name);
  v("state", m.state);
  v("age", m.age);
  v("restarts", m.restarts);
}

template <class V>
void VisitFields(const health_t& m, V& v) {
  VisitHead(m, v);
  v("n_processes", m.n_processes);
  v("processes", m.processes);
}

template <class V>
void VisitFields(const truth_t& m, V& v) {
  VisitHead(m, v);
  v("mission_time", m.mission_time);
  v("pos", m.pos);
  v("vel", m.vel);
  v("accel", m.accel);
  v("orientation", m.orientation);
  v("rotation_rate", m.rotation_rate);
  v("target_pos", m.target_pos);
  v("target_vel", m.target_vel);
  v("target_yaw", m.target_yaw);
  v("target_px", m.target_px);
  v("target_in_image", m.target_in_image);
  v("visible_share", m.visible_share);
  v("n_movers", m.n_movers);
  v("movers", m.movers);
}

template <class V>
void VisitFields(const scenario_t& m, V& v) {
  VisitHead(m, v);
  v("seed", m.seed);
  v("start_utime", m.start_utime);
  v("name", m.name);
  v("yaml", m.yaml);
}

template <class V>
void VisitFields(const status_t& m, V& v) {
  VisitHead(m, v);
  v("name", m.name);
  v("state", m.state);
  v("detail", m.detail);
  v("last_error", m.last_error);
  v("version", m.version);
  v("uptime", m.uptime);
  v("cpu", m.cpu);
  v("rss_mb", m.rss_mb);
  v("n_channels", m.n_channels);
  v("channels", m.channels);
  v("n_stages", m.n_stages);
  v("stages", m.stages);
}

}  // namespace chase::logs
