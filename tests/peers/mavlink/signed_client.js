// Drives a vehicle over UDP with node-mavlink: node signed_client.js MODULES PORT KEY, KEY being 64 hexadecimal digits.
// First set-points that are not signed, then signed ones; prints one JSON line for each heartbeat that it hears.
const path = require("path");
const dgram = require("dgram");
const { PassThrough } = require("stream");
const [modules, port, keyText] = process.argv.slice(2);
const { MavLinkPacketSplitter, MavLinkPacketParser, MavLinkProtocolV2, common, minimal } =
  require(path.join(modules, "node-mavlink"));

const key = Buffer.from(keyText, "hex");
const socket = dgram.createSocket("udp4");
const protocol = new MavLinkProtocolV2(254, 1);
const received = new PassThrough();
let sequence = 0;

// Each link has a time of its own that must go on with each message, and here it counts milliseconds.
function send(message, signed, link) {
  const flags = signed ? MavLinkProtocolV2.IFLAG_SIGNED : 0;
  const serializer = new MavLinkProtocolV2(254, 1, flags);
  const frame = serializer.serialize(message, sequence++ % 256);
  const sent = signed ? protocol.sign(frame, link, key) : frame;
  socket.send(sent, Number(port), "127.0.0.1");
}

function setpoint() {
  const message = new common.SetPositionTargetLocalNed();
  message.timeBootMs = 0;
  message.targetSystem = 1;
  message.targetComponent = 1;
  message.coordinateFrame = 9;
  message.typeMask = 0x5c7;
  message.vx = 0.5;
  message.vy = 0.25;
  return message;
}

socket.on("message", (data) => received.write(data));
received.pipe(new MavLinkPacketSplitter()).pipe(new MavLinkPacketParser()).on("data", (packet) => {
  if (packet.header.msgid === minimal.Heartbeat.MSG_ID) {
    const signature = packet.signature ? (packet.signature.matches(key) ? "right" : "wrong") : "none";
    console.log(JSON.stringify({ system: packet.header.sysid, signature }));
  }
});

let sent = 0;
setInterval(() => {
  const signed = sent++ >= 50;
  if (sent === 51) console.log(JSON.stringify({ signing: true }));
  if (sent % 50 === 1) {
    const heartbeat = new minimal.Heartbeat();
    heartbeat.type = 6;
    heartbeat.autopilot = 8;
    heartbeat.mavlinkVersion = 3;
    send(heartbeat, signed, 2);
  }
  send(setpoint(), signed, 1);
}, 20);
