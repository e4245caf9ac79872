#include "tests/fuzz/wire.h"

#include <google/protobuf/descriptor.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <random>

namespace shaped::fuzz {
namespace {

using google::protobuf::FieldDescriptor;
using google::protobuf::Message;
using Random = std::minstd_rand;

int below(Random& random, int count) { return static_cast<int>(random() % static_cast<unsigned>(count)); }

double peculiarNumber(Random& random) {
  using Limits = std::numeric_limits<double>;
  constexpr double list[] = {0,
                             -0.0,
                             1,
                             -1,
                             0.5,
                             1e-30,
                             1e30,
                             1e300,
                             1e6,
                             3e38,
                             1e39,
                             1e-6,
                             Limits::max(),
                             Limits::infinity(),
                             -Limits::infinity(),
                             Limits::quiet_NaN()};
  return list[below(random, std::size(list))];
}

std::uint64_t peculiarInteger(Random& random) {
  constexpr std::uint64_t list[] = {0, 1, 2, 3, 11, 12, 13, 100, 1000, INT32_MAX, 1ULL << 31, UINT32_MAX, UINT64_MAX};
  return random() % 2 == 0 ? static_cast<std::uint64_t>(below(random, 12)) : list[below(random, std::size(list))];
}

/// Sets a single field, or adds an entry to a repeated one.
void setScalar(Message& message, const FieldDescriptor& field, Random& random) {
  const auto& access = *message.GetReflection();
  const bool list = field.is_repeated();
  switch (field.cpp_type()) {
    case FieldDescriptor::CPPTYPE_DOUBLE:
      return list ? access.AddDouble(&message, &field, peculiarNumber(random))
                  : access.SetDouble(&message, &field, peculiarNumber(random));
    case FieldDescriptor::CPPTYPE_FLOAT: {
      const double number = std::clamp(peculiarNumber(random), -1e39, 1e39);
      const auto value = std::abs(number) > 3e38 ? std::numeric_limits<float>::infinity() : static_cast<float>(number);
      return list ? access.AddFloat(&message, &field, value) : access.SetFloat(&message, &field, value);
    }
    case FieldDescriptor::CPPTYPE_UINT32: {
      const auto value = static_cast<std::uint32_t>(peculiarInteger(random));
      return list ? access.AddUInt32(&message, &field, value) : access.SetUInt32(&message, &field, value);
    }
    case FieldDescriptor::CPPTYPE_UINT64:
      return access.SetUInt64(&message, &field, peculiarInteger(random));
    case FieldDescriptor::CPPTYPE_BOOL:
      return access.SetBool(&message, &field, random() % 2 == 0);
    case FieldDescriptor::CPPTYPE_STRING: {
      const std::string value(static_cast<std::size_t>(below(random, 4)), static_cast<char>('A' + below(random, 4)));
      return list ? access.AddString(&message, &field, value) : access.SetString(&message, &field, value);
    }
    default:
      return;
  }
}

/// Overwrites an entry of a repeated field with a new one.
void replaceEntry(Message& message, const FieldDescriptor& field, Random& random) {
  const auto& access = *message.GetReflection();
  setScalar(message, field, random);
  const int last = access.FieldSize(message, &field) - 1;
  access.SwapElements(&message, &field, below(random, last + 1), last);
  access.RemoveLast(&message, &field);
}

void mutateList(Message& message, const FieldDescriptor& field, Random& random) {
  const auto& access = *message.GetReflection();
  const int size = access.FieldSize(message, &field);
  const bool parts = field.cpp_type() == FieldDescriptor::CPPTYPE_MESSAGE;
  switch (size == 0 ? 0 : below(random, 4)) {
    case 0:
      if (!parts) return setScalar(message, field, random);
      access.AddMessage(&message, &field);
      if (size > 0)
        access.MutableRepeatedMessage(&message, &field, size)
            ->CopyFrom(access.GetRepeatedMessage(message, &field, below(random, size)));
      return;
    case 1:
      return access.RemoveLast(&message, &field);
    case 2:
      return access.SwapElements(&message, &field, below(random, size), below(random, size));
    default:
      if (!parts) return replaceEntry(message, field, random);
      return mutate(*access.MutableRepeatedMessage(&message, &field, below(random, size)), random());
  }
}

}  // namespace

void mutate(Message& message, unsigned seed) {
  Random random(seed + 1);
  const auto& fields = *message.GetDescriptor();
  if (fields.field_count() == 0) return;
  const auto& field = *fields.field(below(random, fields.field_count()));
  const auto& access = *message.GetReflection();
  if (field.is_repeated()) return mutateList(message, field, random);
  if (random() % 16 == 0) return access.ClearField(&message, &field);
  if (field.cpp_type() == FieldDescriptor::CPPTYPE_MESSAGE)
    return mutate(*access.MutableMessage(&message, &field), random());
  setScalar(message, field, random);
}

}  // namespace shaped::fuzz
