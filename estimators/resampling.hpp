// Resampling of N weighted particles into N of equal weight: which particle is whose ancestor.
//
//   c_i = w_1 + ... + w_i (of sum 1);  point p_j in [0, 1) falls to the first i with c_i above it
//   systematic   p_j = (u + j)/N       one u ~ U[0, 1): particle i gets floor or ceil of N w_i offspring
//   stratified   p_j = (u_j + j)/N     a u_j of its own for each: floor(N w_i) - 1 to ceil(N w_i) + 1 offspring
//   residual     floor(N w_i) copies, and the R that are left by stratified points over the remainders N w_i - floor(N w_i):
//                floor(N w_i) to floor(N w_i) + 2 offspring. (By systematic points it would be systematic resampling itself.)
//
// Each gives particle i N w_i offspring on average; ancestors ascend; the cost is linear. The first two: Arulampalam et al.,
// IEEE Trans. Signal Processing 50 (2002), algorithm 2, and Kitagawa (1996). Residual: Liu and Chen (1998), whose remainder is
// multinomial, which has more variance than strata (Douc and Cappe 2005, section 3).
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <string>
#include <vector>

#include "common/random.hpp"

namespace slipstream {

enum class Resampling { kSystematic, kStratified, kResidual };

// Of the name in a tuning: "systematic", "stratified" or "residual". Others are a mistake of ours: the scenario's reader knows
// them.
Resampling resampling_named(const std::string& name);

class Resampler {
 public:
  Resampler(Resampling method, std::size_t particles) : method_(method), mark_(particles + 2), uniform_(particles + 1) {}

  // Chooses. `weight` of sum `total`, not negative.
  void draw(std::span<const double> weight, double total, RandomStream& random);

  // Each offspring takes its ancestor's values: kColumns arrays, `stride` apart.
  template <int kColumns, typename T>
  void inherit(const T* from, T* to, std::size_t stride) const {
    const std::size_t n = mark_.size() - 2;
    const std::uint32_t* const mark = mark_.data();
    std::uint32_t ancestor = 0;
    for (std::size_t j = 0; j < n; ++j) {
      ancestor = mark[j] > ancestor ? mark[j] : ancestor;
      for (std::size_t c = 0; c < kColumns; ++c) to[c * stride + j] = from[c * stride + ancestor];
    }
  }

 private:
  template <typename F>
  void place(std::span<const double> weight, double scale, const F& offspring_up_to);

  Resampling method_;
  std::vector<std::uint32_t> mark_;  // a particle's number where its offspring begin, else less; and two more, of no meaning
  std::vector<double> uniform_;
};

}  // namespace slipstream
