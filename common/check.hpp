// A check for our own bugs that stays on in release builds. Wrong input from outside is a Refusal (refusal.hpp), not a check.
#pragma once

#include <cstdio>
#include <cstdlib>

#define SLIPSTREAM_CHECK(condition)                                                               \
  do {                                                                                            \
    if (!(condition)) {                                                                           \
      std::fprintf(stderr, "%s:%d: internal check failed: %s\n", __FILE__, __LINE__, #condition); \
      std::abort();                                                                               \
    }                                                                                             \
  } while (false)
