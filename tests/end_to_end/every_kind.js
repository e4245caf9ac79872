'use strict';
// What a Node.js client meets over TLS with a token, in each kind of call; prints it as one JSON document for
// foreign_clients_test.py. Its twin is every_kind.py.
//
//     node every_kind.js SCENARIO.json

const fs = require('fs');
const path = require('path');
const {connect, unary, details, grpc} = require(path.join(__dirname, '../../docs/examples/node_client/shaped.js'));

const PATIENCE = 60; // [s] of every wait
const TRACEPARENT = '00-0af7651916cd43dd8448eb211c80319c-b7ad6b7169203331-01';

const scenario = JSON.parse(fs.readFileSync(process.argv[2], 'utf8'));
const {address, ca, token, model, vertices, faces, frames, markers} = scenario;
const daemon = connect(address, {ca, token});
const limit = (seconds = PATIENCE) => ({deadline: Date.now() + 1000 * seconds});

/** An error as its code, message and details. */
function failure(error) {
  const {ErrorInfo: info, BadRequest: bad, RetryInfo: retry, ...others} = details(error);
  const told = {code: grpc.status[error.code], message: error.details,
    details: [...Object.entries({ErrorInfo: info, BadRequest: bad, RetryInfo: retry}).filter(([, found]) => found).map(([name]) => name),
      ...Object.keys(others)].sort()};
  if (info) Object.assign(told, {reason: info.reason, domain: info.domain});
  if (bad) told.field = bad.field_violations[0].field;
  if (retry) told.retry_seconds = retry.retry_delay.seconds + 1e-9 * retry.retry_delay.nanos;
  return told;
}

/** What a promise fails with. */
const failing = (promise) => promise.then(() => ({code: 'OK'}), failure);

/** Every message of a stream of answers, once it has ended well. */
async function all(stream) {
  const messages = [];
  for await (const message of stream) messages.push(message);
  return messages;
}

function unaryCall() {
  const metadata = new grpc.Metadata();
  metadata.set('traceparent', TRACEPARENT);
  return new Promise((resolve, reject) => {
    let models, trace;
    const call = daemon.models.List({}, metadata, limit(), (error, answer) => {
      if (error) return reject(error);
      models = answer.models.map((each) => [each.model.name, each.vertex_count]);
      return undefined;
    });
    call.on('metadata', (initial) => { trace = initial.get('traceparent')[0].split('-')[1]; });
    call.on('status', () => resolve({models, trace}));
  });
}

function upload(name, shapes) {
  return new Promise((resolve, reject) => {
    const call = daemon.datasets.Upload(limit(), (error, answer) => (error ? reject(error) : resolve(answer)));
    call.write({header: {name, vertex_count: vertices, faces, frames: shapes.length}});
    for (const positions of shapes) call.write({frame: {positions}});
    call.end();
  });
}

async function clientStream() {
  const {dataset} = await upload('from_node', frames);
  return {frames: dataset.frames, vertices: dataset.vertex_count};
}

function interpolate(times, seconds) {
  const [first, last] = [frames[0], frames[frames.length - 1]];
  return daemon.shapes.Interpolate({from: {positions: first, faces}, to: {positions: last}, times}, limit(seconds));
}

async function serverStream() {
  const answers = await all(interpolate([0, 0.5, 1]));
  const wanted = frames[frames.length - 1];
  const far = answers[3].frame.shape.positions.reduce((most, value, i) => Math.max(most, Math.abs(value - wanted[i])), 0);
  return {parts: answers.map(({part}) => part), far};
}

const markerFrame = (number) => ({frame: {frame: number,
  positions: markers.flatMap((vertex) => frames[number].slice(3 * vertex, 3 * vertex + 3))}});
const look = ({frame, model: {version}, rms}) => [frame, version, rms < 0.05];

/** A stream of markers with its first answer, and the answers to come. */
async function openFit() {
  const call = daemon.shapes.FitMarkers(limit());
  const answers = call[Symbol.asyncIterator]();
  call.write({setup: {model: {name: model}, without_shapes: true,
    marker_set: {markers: markers.map((vertex) => ({label: `m${vertex}`, vertex}))}}});
  call.write(markerFrame(0));
  return {call, first: (await answers.next()).value, answers};
}

/** Ends a stream of requests; how many answers still come. */
async function finish({call, answers}) {
  call.end();
  let more = 0;
  while (!(await answers.next()).done) ++more;
  return more;
}

/** Each frame is sent after the answer to the one before. */
async function bothStreams() {
  const fit = await openFit();
  fit.call.write(markerFrame(1));
  const second = (await fit.answers.next()).value;
  return {answers: [look(fit.first), look(second)], more: await finish(fit)};
}

/** What a stream meets when all places are taken. */
async function busy() {
  const held = [];
  let refused = {code: 'OK'};
  while (refused.code === 'OK' && held.length < 2 * scenario.open_streams)
    refused = await failing(openFit().then((fit) => held.push(fit)));
  for (const fit of held) await finish(fit);
  return {...refused, open: held.length};
}

async function deadline() {
  const begin = process.hrtime.bigint();
  const waiting = (await failing(unary(daemon.models, 'WaitUntilReady', {model: {name: 'never'}}, 0.5))).code;
  const solving = (await failing(all(interpolate(Array(10000).fill(0.3), 0.5)))).code;
  const seconds = 1e-9 * Number(process.hrtime.bigint() - begin);
  return {waiting, solving, seconds, left: await callsLeft()};
}

async function cancellation() {
  const call = interpolate(Array(10000).fill(0.3));
  const answers = call[Symbol.asyncIterator]();
  const first = (await answers.next()).value.part;
  call.cancel();
  const drained = async () => { while (!(await answers.next()).done); };
  return {first, code: (await failing(drained())).code, left: await callsLeft()};
}

/** Calls of Interpolate and WaitUntilReady that the daemon still works on, once they are none or patience ends. */
async function callsLeft() {
  const until = Date.now() + 1000 * PATIENCE;
  for (;;) {
    const {methods} = await unary(daemon.admin, 'GetStatistics', {});
    const left = methods.filter(({method}) => ['Shapes.Interpolate', 'Models.WaitUntilReady'].includes(method))
      .reduce((sum, each) => sum + each.in_flight, 0);
    if (left === 0 || Date.now() > until) return left;
    await new Promise((resolve) => setTimeout(resolve, 50));
  }
}

async function errorDetails() {
  const project = (name) => failing(unary(daemon.shapes, 'Project', {model: {name}, shape: {positions: frames[0].slice(0, -1)}}));
  return {bad: await project(model), missing: await project('none')};
}

/** Without a token, with one that lacks the role, and by a daemon of another authority. */
async function refusals() {
  const code = async (options) => {
    const client = connect(address, {ca, ...options});
    const told = await failing(unary(client.models, 'Delete', {model: {name: 'none'}}));
    client.close();
    return told.code;
  };
  return {nobody: await code({}), reader: await code({token: scenario.reader}), stranger: await code({token, ca: scenario.other_ca})};
}

async function main() {
  const kinds = {unary: unaryCall, client_stream: clientStream,
    refused_client_stream: () => failing(upload('refused', [frames[0], frames[1].slice(0, -1)])), server_stream: serverStream,
    both_streams: bothStreams, busy, deadline, cancellation, error_details: errorDetails, refusals};
  const seen = {};
  for (const [kind, run] of Object.entries(kinds)) seen[kind] = await run();
  daemon.close();
  console.log(JSON.stringify(seen));
}

main().catch((error) => {
  console.error(error.stack);
  process.exitCode = 1;
});
