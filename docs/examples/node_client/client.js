'use strict';
// Lists the models of a daemon, then projects a bent copy of one model's mean and synthesizes the answer again.
//
//     npm ci
//     node client.js localhost:50051 MODEL [CA.crt TOKEN_FILE]

const fs = require('fs');
const {connect, unary, details, grpc} = require('./shaped.js');

/** Moves every vertex along y, by a shear that the model can only approximate. */
function bend(positions) {
  const x = positions.filter((_, i) => i % 3 === 0);
  const least = x.reduce((a, b) => Math.min(a, b)), most = x.reduce((a, b) => Math.max(a, b));
  return positions.map((value, i) =>
    (i % 3 === 1 ? value + 0.2 * (positions[i - 1] - (least + most) / 2) ** 2 / (most - least) : value));
}

async function main([address, name, ca, tokenFile]) {
  const daemon = connect(address, {ca, token: tokenFile && fs.readFileSync(tokenFile, 'utf8').trim()});
  for (const {model, vertex_count: vertices, shell_pga: pga, body} of (await unary(daemon.models, 'List', {})).models)
    console.log(`${model.name}@${model.version}: ${vertices} vertices, ${(body || pga).modes} modes`);

  const model = {name};
  const {description, mean} = await unary(daemon.models, 'Get', {model, with_mean: true});
  const shape = {positions: bend(mean.positions), topology_id: description.topology_id};
  const projected = await unary(daemon.shapes, 'Project', {model, shape});
  console.log(`projected: ${projected.report.termination} in ${projected.report.seconds.toFixed(2)} s, ` +
    `${(1000 * projected.score.residual_distance).toFixed(1)} mm unexplained`);

  const again = await unary(daemon.shapes, 'Synthesize', {model, coefficients: projected.coefficients});
  console.log(`synthesized ${again.shape.positions.length / 3} vertices`);

  shape.positions.pop(); // what an error looks like
  try {
    await unary(daemon.shapes, 'Project', {model, shape});
  } catch (error) {
    console.log(`refused: ${grpc.status[error.code]}: ${error.details} (${details(error).ErrorInfo.reason})`);
  }
  daemon.close();
}

main(process.argv.slice(2)).catch((error) => {
  console.error(error.message);
  process.exitCode = 1;
});
