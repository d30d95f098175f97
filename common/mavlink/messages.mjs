// Writes the C++ header with the messages that we use, from the definitions in the npm
// package mavlink-mappings. Usage: node messages.mjs OUT.h
import { writeFileSync } from 'node:fs'
import { createRequire } from 'node:module'

const MESSAGES = [
  'HEARTBEAT', 'SYS_STATUS', 'ATTITUDE_QUATERNION', 'RAW_IMU', 'SCALED_IMU', 'HIGHRES_IMU',
  'LOCAL_POSITION_NED', 'RC_CHANNELS', 'COMMAND_LONG', 'COMMAND_ACK', 'SET_ATTITUDE_TARGET',
  'TIMESYNC', 'BATTERY_STATUS', 'EXTENDED_SYS_STATE', 'STATUSTEXT', 'ODOMETRY',
]
const ENUMS = [
  'MavAutopilot', 'MavType', 'MavState', 'MavModeFlag', 'MavResult', 'MavLandedState',
  'MavEstimatorType', 'MavFrame', 'MavSeverity', 'MavComponent', 'AttitudeTargetTypemask',
]
const COMMANDS = ['DO_SET_MODE', 'COMPONENT_ARM_DISARM', 'SET_MESSAGE_INTERVAL', 'REQUEST_MESSAGE',
  'NAV_LAND', 'RUN_PREARM_CHECKS']

let mappings
try {
  mappings = createRequire(import.meta.url)('mavlink-mappings')
} catch {
  console.error('common/mavlink: the npm package mavlink-mappings is missing; cure: deploy/setup')
  process.exit(1)
}
const dialects = [mappings.minimal, mappings.standard, mappings.common]
const classes = new Map(dialects.flatMap(d => Object.values(d.REGISTRY)).map(c => [c.MSG_NAME, c]))

const pascal = name => name.toLowerCase().replace(/(^|_)(\w)/g, (_, __, letter) => letter.toUpperCase())

function field(f) {
  const element = f.type.replace('[]', '').replace('_mavlink_version', '')
  return f.length ? `std::array<${element}, ${f.length}> ${f.source}{};` : `${element} ${f.source}{};`
}

function message(name) {
  const c = classes.get(name)
  const base = c.FIELDS.filter(f => !f.extension).reduce((sum, f) => sum + f.size * (f.length || 1), 0)
  return `/// ${name}; fields and units: mavlink.io/en/messages/common.html#${name}
struct ${pascal(name)} {
  static constexpr const char* kName = "${name}";
  static constexpr uint32_t kId = ${c.MSG_ID};
  static constexpr std::size_t kLength = ${c.PAYLOAD_LENGTH};  ///< bytes, with extensions
  static constexpr std::size_t kBaseLength = ${base};  ///< bytes, without
${c.FIELDS.map(f => '  ' + field(f)).join('\n')}

  /// v(name, offset in the payload, field) for each field in wire order.
  template <class M, class V>
  static void Visit(M& m, V& v) {
${c.FIELDS.map(f => `    v("${f.source}", std::size_t{${f.offset}}, m.${f.source});`).join('\n')}
  }
};
`
}

function enumeration(name) {
  const values = dialects.map(d => d[name]).find(e => e)
  const rows = Object.entries(values).filter(([key]) => !/^\d/.test(key))
  return `enum class ${name} : uint32_t {
${rows.map(([key, value]) => `  ${key} = ${value},`).join('\n')}
};
`
}

const checksums = Object.entries(mappings.MSG_ID_MAGIC_NUMBER)
  .map(([id, extra]) => [Number(id), Number(extra)]).sort((a, b) => a[0] - b[0])

writeFileSync(process.argv[2], `// Made by common/mavlink/messages.mjs. Not to be edited.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <tuple>

namespace chase::mavlink::mav {

${ENUMS.map(enumeration).join('\n')}
enum class MavCmd : uint16_t {
${COMMANDS.map(c => `  ${c} = ${mappings.common.MavCmd[c]},`).join('\n')}
};

${MESSAGES.map(message).join('\n')}
/// Every message of ours.
using AllMessages = std::tuple<${MESSAGES.map(pascal).join(', ')}>;

struct Checksum {
  uint32_t id;
  uint8_t extra;
};
/// CRC_EXTRA of every message of every dialect, by id.
inline constexpr Checksum kChecksums[] = {
${checksums.map(([id, extra]) => `    {${id}, ${extra}},`).join('\n')}
};

}  // namespace chase::mavlink::mav
`)
