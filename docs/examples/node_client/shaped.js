'use strict';
// What a program in Node.js needs to call shaped: the services out of proto/, a connection, and the details of errors.

const fs = require('fs');
const path = require('path');
const grpc = require('@grpc/grpc-js');
const loader = require('@grpc/proto-loader');

const PROTO = path.resolve(__dirname, '../../../proto');
const FILES = ['admin', 'datasets', 'jobs', 'models', 'server', 'shapes'].map((name) => `shaped/v1/${name}.proto`);

// Field names as in proto/, enums by name, 64-bit integers as numbers: none of the daemon's exceeds 2^53.
const definition = loader.loadSync([...FILES, 'google/rpc/status.proto', 'google/rpc/error_details.proto'],
  {includeDirs: [PROTO], keepCase: true, enums: String, longs: Number, defaults: true, oneofs: true});
const {shaped: {v1: services}} = grpc.loadPackageDefinition(definition);

/**
 * Connects to a daemon. `address` is host:port; `ca` names a file of the authorities to trust (without it, the connection is
 * in the clear), `token` is sent with every call, over TLS only. Returns one client a service (`models`, `datasets`, `jobs`,
 * `shapes`, `server`, `admin`), and `close()`.
 */
function connect(address, {ca, token} = {}) {
  let credentials = ca ? grpc.credentials.createSsl(fs.readFileSync(ca)) : grpc.credentials.createInsecure();
  if (token) {
    if (!ca) throw new Error('a token is sent over TLS only: name the authority with `ca`');
    credentials = grpc.credentials.combineChannelCredentials(credentials,
      grpc.credentials.createFromMetadataGenerator((_, done) => {
        const metadata = new grpc.Metadata();
        metadata.set('authorization', `Bearer ${token}`);
        done(null, metadata);
      }));
  }
  // Shapes may be larger than gRPC's default limit of 4 MiB; the daemon tells its own (Server.GetLimits).
  const options = {'grpc.max_receive_message_length': -1, 'grpc.max_send_message_length': -1};
  const clients = {};
  for (const name of ['Models', 'Datasets', 'Jobs', 'Shapes', 'Server', 'Admin'])
    clients[name.toLowerCase()] = new services[name](address, credentials, options);
  return {...clients, close: () => Object.values(clients).forEach((client) => client.close())};
}

/** A unary call as a promise: `await unary(daemon.models, 'List', {})`. `seconds` is its deadline. */
function unary(client, method, request, seconds = 60) {
  return new Promise((resolve, reject) => {
    client[method](request, {deadline: Date.now() + 1000 * seconds}, (error, answer) => (error ? reject(error) : resolve(answer)));
  });
}

/** The google.rpc details of an error by name: {ErrorInfo: {reason, domain}, BadRequest: ..., RetryInfo: ...}. */
function details(error) {
  const found = {};
  for (const bytes of (error.metadata && error.metadata.get('grpc-status-details-bin')) || []) {
    for (const {type_url: type, value} of definition['google.rpc.Status'].deserialize(bytes).details) {
      const name = type.slice(type.lastIndexOf('/') + 1);
      if (definition[name]) found[name.replace('google.rpc.', '')] = definition[name].deserialize(value);
    }
  }
  return found;
}

module.exports = {connect, unary, details, grpc};
