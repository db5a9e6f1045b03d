// The alternatives of a variant as the types of a typed test.
#pragma once

#include <gtest/gtest.h>

#include <variant>

namespace slipstream {

template <typename Variant>
struct Alternatives;
template <typename... Ts>
struct Alternatives<std::variant<Ts...>> {
  using Types = ::testing::Types<Ts...>;
};

}  // namespace slipstream
