// Reads an MCAP file with the npm package @mcap/core and says how many messages each topic has.
// Exit code 77: the package is not installed, neither globally nor in the folder NODE_MODULES.
import {execSync} from 'node:child_process';
import {readFileSync} from 'node:fs';
import {createRequire} from 'node:module';

let core;
try {
  const folder = process.env.NODE_MODULES ?? execSync('npm root -g', {stdio: 'pipe'}).toString().trim();
  core = createRequire(folder + '/x.js')('@mcap/core');
} catch {
  process.exit(77);
}
const bytes = readFileSync(process.argv[2]);
const readable = {
  size: async () => BigInt(bytes.length),
  read: async (at, size) => new Uint8Array(bytes.subarray(Number(at), Number(at + size))),
};
const reader = await core.McapIndexedReader.Initialize({readable});
const counts = new Map();
let messages = 0;
for await (const message of reader.readMessages()) {
  const topic = reader.channelsById.get(message.channelId).topic;
  counts.set(topic, (counts.get(topic) ?? 0) + 1);
  ++messages;
}
// Once more as a stream, which checks the CRC of every chunk.
const stream = new core.McapStreamReader({validateCrcs: true});
stream.append(bytes);
let streamed = 0;
for (let record; (record = stream.nextRecord());)
  if (record.type === 'Message') ++streamed;
if (streamed !== messages || !stream.done()) throw new Error(`${streamed} messages in the stream`);
const topics = [...counts].sort().map(([topic, count]) => `${topic} ${count}`);
console.log(`${reader.header.profile}: ${messages} messages, ${topics.join(', ')}`);
