#pragma once

#include <string>

namespace shaped::server {

/// Whether an address to listen on, as --listen takes it, can be reached from this machine only: HOST:PORT where HOST
/// is, or resolves to, nothing but 127.0.0.0/8 and ::1, or a Unix socket. What cannot be understood or resolved is not.
bool isLoopback(const std::string& address);

}  // namespace shaped::server
