// Runs code with packs of the widest registers that the processor has: compiled for each, chosen at run time.
//
//   with_widest([&](auto width) { using P = PackOf<width, 8>; ... })
//
// All that the code calls is inlined into it (flatten), or it would not be compiled for the wider registers. Packs of the same
// number of lanes have the same bits with all widths; a test may ask for narrow ones (at_most).
#pragma once

#include <algorithm>
#include <type_traits>

namespace slipstream {

template <int kWidth>
using Width = std::integral_constant<int, kWidth>;

namespace widest_detail {
template <typename F>
[[gnu::flatten, gnu::noinline]] auto run_2(const F& f) {
  return f(Width<2>{});
}
#if defined(__x86_64__) && defined(__GNUC__)
template <typename F>
[[gnu::target("avx2"), gnu::flatten, gnu::noinline]] auto run_4(const F& f) {
  return f(Width<4>{});
}
template <typename F>
[[gnu::target("avx512f,avx512vl,avx512dq,avx512bw"), gnu::flatten, gnu::noinline]] auto run_8(const F& f) {
  return f(Width<8>{});
}
inline const int of_processor = __builtin_cpu_supports("avx512f") && __builtin_cpu_supports("avx512vl") &&
                                        __builtin_cpu_supports("avx512dq") && __builtin_cpu_supports("avx512bw")
                                    ? 8
                                : __builtin_cpu_supports("avx2") ? 4
                                                                 : 2;
#else
inline const int of_processor = 2;
#endif
inline int at_most = 8;
}  // namespace widest_detail

template <typename F>
auto with_widest(const F& f) {
#if defined(__x86_64__) && defined(__GNUC__)
  const int width = std::min(widest_detail::of_processor, widest_detail::at_most);
  if (width == 8) return widest_detail::run_8(f);
  if (width == 4) return widest_detail::run_4(f);
#endif
  return widest_detail::run_2(f);
}

}  // namespace slipstream
