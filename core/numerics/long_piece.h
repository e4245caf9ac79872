#pragma once

#include <functional>
#include <string_view>

namespace shaped {

/// Marks work of milliseconds or more on a mesh of thousands of vertices that looks at no stop token on its way, or
/// only in the midst: after a stop none may begin but "solve", a tenth of a factorisation. Tests count them; where nobody
/// listens, marking one costs two loads. name: a literal.
class LongPiece {
 public:
  explicit LongPiece(std::string_view name);
  ~LongPiece();
  LongPiece(const LongPiece&) = delete;
  LongPiece& operator=(const LongPiece&) = delete;

 private:
  std::string_view name_;
};

/// Hears of every piece's beginning and end, from the thread that does it. Must not throw.
using PieceListener = std::function<void(std::string_view name, bool begins)>;

/// Listens while it lives. One at a time, made and destroyed while no solver runs.
class PieceListening {
 public:
  explicit PieceListening(PieceListener listener);
  ~PieceListening();
  PieceListening(const PieceListening&) = delete;
  PieceListening& operator=(const PieceListening&) = delete;

 private:
  PieceListener listener_;
};

}  // namespace shaped
