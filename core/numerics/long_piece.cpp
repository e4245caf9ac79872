#include "core/numerics/long_piece.h"

#include <atomic>

namespace shaped {
namespace {

std::atomic<const PieceListener*> listening{nullptr};

void tell(std::string_view name, bool begins) {
  if (const auto* listener = listening.load(std::memory_order_acquire)) (*listener)(name, begins);
}

}  // namespace

LongPiece::LongPiece(std::string_view name) : name_(name) { tell(name_, true); }
LongPiece::~LongPiece() { tell(name_, false); }

PieceListening::PieceListening(PieceListener listener) : listener_(std::move(listener)) { listening = &listener_; }
PieceListening::~PieceListening() { listening = nullptr; }

}  // namespace shaped
