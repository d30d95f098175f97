// Our MAVLink codec against node-mavlink, byte for byte and value for value, both ways.
// Usage: node fcu_exchange.mjs PROGRAM COUNT [SEED]
import { spawnSync } from 'node:child_process'
import { createRequire } from 'node:module'

const require = createRequire(new URL('../../common/mavlink/package.json', import.meta.url))
const { minimal, standard, common } = require('mavlink-mappings')
const { MavLinkPacketSplitter, MavLinkPacketSignature, MavLinkProtocolV1, MavLinkProtocolV2 } = require('node-mavlink')

const [program, count, seed] = [process.argv[2], Number(process.argv[3]), Number(process.argv[4] ?? 1)]
const registry = { ...minimal.REGISTRY, ...standard.REGISTRY, ...common.REGISTRY }
const names = new Map(Object.values(registry).map(c => [c.MSG_NAME, c]))
const key = Buffer.from([...Array(32).keys()])
let problems = 0

function complain(...words) {
  if (++problems <= 10) console.log(...words)
}

function call(args, input) {
  const answer = spawnSync(program, args, { input, maxBuffer: 2 ** 30 })
  if (answer.status !== 0) throw new Error(`${program} ${args.join(' ')} exits ${answer.status}`)
  return answer.stdout.toString().trimEnd().split('\n')
}

// The values as fcu_exchange.cpp prints them.
const bits = new DataView(new ArrayBuffer(4))
function print(type, value) {
  if (type === 'char') return [...value].map(c => c.charCodeAt(0) + ',').join('')
  if (type !== 'float') return String(value)
  bits.setFloat32(0, value)
  return String(bits.getUint32(0))
}
function line(clazz, message) {
  return clazz.MSG_NAME + clazz.FIELDS.map(f => {
    const type = f.type.replace('[]', '')
    const value = message[f.name]
    return ` ${f.source}=` + (f.length && type !== 'char' ? value.map(v => print(type, v)).join(',') : print(type, value))
  }).join('')
}

// What node-mavlink makes of one frame.
function parse(bytes) {
  const found = []
  const splitter = new MavLinkPacketSplitter()
  splitter.push = packet => found.push(packet.buffer)
  for (let i = 0; i < bytes.length; i += 7) splitter._transform(bytes.subarray(i, i + 7), null, () => {})
  if (found.length !== 1 || !found[0].equals(bytes)) return null
  const protocol = new MavLinkProtocolV2()
  const header = protocol.header(bytes)
  const clazz = registry[header.msgid]
  return { header, clazz, message: protocol.data(protocol.payload(bytes), clazz) }
}

function fromOurs() {
  const types = new Map()
  for (const text of call(['make', seed, count])) {
    const [hex, name] = text.split(' ', 2)
    const bytes = Buffer.from(hex, 'hex')
    const seen = parse(bytes)
    types.set(name, (types.get(name) ?? 0) + 1)
    if (!seen) { complain('node-mavlink refuses', text); continue }
    const { header, clazz, message } = seen
    if (`${hex} ${line(clazz, message)}` !== text) complain('read otherwise:', text, '\n ', line(clazz, message))
    const signed = header.incompatibilityFlags & 1
    const again = new MavLinkProtocolV2(header.sysid, header.compid, signed).serialize(message, header.seq)
    const body = signed ? bytes.subarray(0, -13) : bytes
    const allZero = body[1] === 1 && body[10] === 0 // node-mavlink cuts the first byte too; the guide says not to
    if (!allZero && !again.equals(body)) complain('written otherwise:', hex, again.toString('hex'))
    if (signed && !new MavLinkPacketSignature(bytes).matches(key)) complain('signature:', hex)
  }
  return types
}

let state = BigInt(seed)
function random() { // splitmix64
  state = (state + 0x9E3779B97F4A7C15n) & 0xFFFFFFFFFFFFFFFFn
  let z = state
  z = ((z ^ (z >> 30n)) * 0xBF58476D1CE4E5B9n) & 0xFFFFFFFFFFFFFFFFn
  z = ((z ^ (z >> 27n)) * 0x94D049BB133111EBn) & 0xFFFFFFFFFFFFFFFFn
  return z ^ (z >> 31n)
}
function value(type) {
  const r = random()
  if (type === 'float') {
    bits.setUint32(0, Number(r & 0xFFFFFFFFn))
    const x = bits.getFloat32(0)
    return Number.isNaN(x) ? 1 : x
  }
  const [, sign, size] = type.match(/^(u?)int(\d+)_t/)
  const cut = sign ? BigInt.asUintN(Number(size), r) : BigInt.asIntN(Number(size), r)
  return size === '64' ? cut : Number(cut)
}
function field(f) {
  const type = f.type.replace('[]', '').replace('_mavlink_version', '')
  const zero = random() % 4n === 0n
  if (type === 'char')
    return zero ? '' : Array.from({ length: Number(random() % BigInt(f.length + 1)) },
      () => String.fromCharCode(Number(1n + random() % 255n))).join('')
  const one = () => zero ? (type.endsWith('64_t') ? 0n : 0) : value(type)
  return f.length ? Array.from({ length: f.length }, one) : one()
}

function toOurs(types) {
  const sent = []
  for (let i = 0; i < count; ++i) {
    const clazz = names.get(types[i % types.length])
    const message = new clazz()
    for (const f of clazz.FIELDS) message[f.name] = field(f)
    if (clazz.FIELDS.every(f => !Number(f.type === 'char[]' ? message[f.name].length : [message[f.name]].flat().some(x => x))))
      message[clazz.FIELDS[0].name] = clazz.FIELDS[0].type.includes('64') ? 1n : 1 // node-mavlink cuts the first byte too
    const [sysid, compid, seq] = [1 + i % 250, 1 + i % 7, i % 256]
    const kind = Number(random() % 8n)
    const signed = kind === 0 ? 1 : 0
    const protocol = kind === 1 && clazz.MSG_ID < 256 ? new MavLinkProtocolV1(sysid, compid)
      : new MavLinkProtocolV2(sysid, compid, signed)
    const body = protocol.serialize(message, seq)
    const bytes = signed ? protocol.sign(body, 3, key, 1_800_000_000_000 + i) : body
    sent.push({ clazz, message, bytes, hex: new MavLinkProtocolV2(sysid, compid).serialize(message, seq).toString('hex') })
  }
  const answers = call(['read'], sent.map(s => s.bytes.toString('hex')).join('\n') + '\n')
  if (answers.length !== sent.length) complain(`${answers.length} answers for ${sent.length} frames`)
  sent.forEach((s, i) => {
    const expected = `${s.hex} ${line(s.clazz, s.message)}`
    if (answers[i] !== expected) complain('expected', expected, '\n     got', answers[i])
  })
}

const types = fromOurs()
toOurs([...types.keys()])
console.log(`${count} messages of ${types.size} types each way, ${problems} problems`)
process.exit(problems ? 1 : 0)
