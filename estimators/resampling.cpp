#include "estimators/resampling.hpp"

#include <algorithm>
#include <cmath>

#include "common/check.hpp"

namespace slipstream {

Resampling resampling_named(const std::string& name) {
  if (name == "systematic") return Resampling::kSystematic;
  if (name == "stratified") return Resampling::kStratified;
  SLIPSTREAM_CHECK(name == "residual");
  return Resampling::kResidual;
}

// offspring_up_to(c): how many points lie below c, of N, where c = scale (w_1 + ... + w_i); with rounding N + 1 at most.
//
// Each particle leaves its mark where its offspring begin; those without offspring are overwritten by the next. Four sums at a
// time, so that none waits for more than one before it; (a + b) + (c + d) keeps them ascending whatever the rounding.
template <typename F>
void Resampler::place(std::span<const double> weight, double scale, const F& offspring_up_to) {
  const auto n = static_cast<std::int32_t>(weight.size());
  const double* const w = weight.data();
  std::uint32_t* const mark = mark_.data();
  std::fill_n(mark, n + 2, 0U);
  double before = 0.0;
  std::int32_t begin = 0, i = 0;
  const auto end_at = [&](double c) {
    mark[begin] = static_cast<std::uint32_t>(i++);
    begin = offspring_up_to(scale * c);
  };
  while (i + 4 <= n) {
    const double a = w[i], ab = a + w[i + 1], abc = ab + w[i + 2], abcd = ab + (w[i + 2] + w[i + 3]);
    end_at(before + a);
    end_at(before + ab);
    end_at(before + abc);
    end_at(before + abcd);
    before += abcd;
  }
  while (i < n) {
    before += w[i];
    end_at(before);
  }
}

void Resampler::draw(std::span<const double> weight, double total, RandomStream& random) {
  const double scale = static_cast<double>(weight.size()) / total;
  switch (method_) {
    case Resampling::kSystematic: {
      const double up = 1.0 - random.uniform();
      return place(weight, scale, [&](double c) { return static_cast<std::int32_t>(c + up); });
    }
    case Resampling::kStratified: {
      for (double& u : uniform_) u = random.uniform();
      const double* const uniform = uniform_.data();
      const double most = static_cast<double>(weight.size());
      return place(weight, scale, [&](double c) {
        const double at = std::min(c, most);  // rounding
        const auto whole = static_cast<std::int32_t>(at);
        return whole + (uniform[whole] < at - whole ? 1 : 0);
      });
    }
    case Resampling::kResidual: {
      for (double& u : uniform_) u = random.uniform();
      const double* const uniform = uniform_.data();
      double before = 0.0, remainders = 0.0;
      std::int32_t copies = 0;
      return place(weight, scale, [&](double c) {
        const double expected = c - before;
        before = c;
        const auto whole = static_cast<std::int32_t>(expected);
        copies += whole;
        remainders += expected - whole;
        const auto stratum = static_cast<std::int32_t>(remainders);
        return copies + stratum + (uniform[stratum] < remainders - stratum ? 1 : 0);
      });
    }
  }
}

}  // namespace slipstream
