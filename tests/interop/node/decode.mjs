// Reads what an autopilot sent with node-mavlink, a MAVLink implementation that shares no code with pymavlink.
//
//   node decode.mjs FRAMES MAGIC SAMPLES
//
// FRAMES: a file of MAVLink frames, one after the other. MAGIC: a JSON object of CRC_EXTRA by message id, for messages
// that node-mavlink does not know: their frames are checked, their fields are not read. Prints one JSON object: how many
// frames were right and wrong, and the fields of the first SAMPLES messages of each id.
import { readFileSync } from 'node:fs'
import { MavLinkPacketParser, MavLinkPacketSplitter, MSG_ID_MAGIC_NUMBER } from 'node-mavlink'
import * as mappings from 'mavlink-mappings'

const [framesFile, magicFile, samples] = process.argv.slice(2)
const magicNumbers = { ...JSON.parse(readFileSync(magicFile)), ...MSG_ID_MAGIC_NUMBER }
const registry = Object.assign({}, ...['development', 'common', 'standard', 'minimal'].map((name) => mappings[name]?.REGISTRY ?? {}))

const plain = (value) => (typeof value === 'bigint' ? value.toString() : Number.isNaN(value) ? 'NaN' : value)
const result = { crcErrors: 0, decoded: 0, fieldless: {}, failures: [], messages: {} }
const splitter = new MavLinkPacketSplitter({}, { magicNumbers, onCrcError: () => result.crcErrors++ })
const parser = new MavLinkPacketParser()

parser.on('data', (packet) => {
  const id = packet.header.msgid
  const kind = registry[id]
  if (kind === undefined) {
    result.fieldless[id] = (result.fieldless[id] ?? 0) + 1
    return
  }
  try {
    const data = packet.protocol.data(packet.payload, kind)
    result.decoded++
    const kept = (result.messages[id] ??= [])
    if (kept.length < Number(samples)) {
      const fields = {}
      for (const field of kind.FIELDS) {
        const value = data[field.name]
        fields[field.source] = Array.isArray(value) ? value.map(plain) : plain(value)
      }
      kept.push({ header: [packet.header.seq, packet.header.sysid, packet.header.compid], fields })
    }
  } catch (error) {
    result.failures.push(`${kind.MSG_NAME}: ${error.message}`)
  }
})
parser.on('end', () => {
  result.valid = splitter.validPackages
  result.invalid = splitter.invalidPackages
  result.unknown = splitter.unknownPackagesCount ?? splitter.unknownPackages
  process.stdout.write(JSON.stringify(result))
})
splitter.pipe(parser)
splitter.end(readFileSync(framesFile))
