// Chapter 3: the magic formula on four surfaces (Fig. 1, Table 1).
#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "models/parts/pacejka.hpp"
#include "reproduce/monte_carlo.hpp"

namespace slipstream {

void reproduce_tyre(const Bench& bench, Outcome& o) {
  bench.progress(0, 1);
  Sketch figure("Fig. 1", "Friction on different surfaces", "longitudinal slip (-)", {0.0, 1.0});
  figure.panel("friction (-)", 380);
  Table table{"Coefficients of the magic formula, and what follows from them",
              {{"surface", false}, {"B"}, {"C"}, {"D"}, {"E"}, {"slope B C D"}, {"peak"}, {"at slip"}},
              {}};
  std::size_t k = 0;
  for (const Surface& s : kSurfaces) {
    std::vector<double> slip, mu;
    for (int i = 0; i <= 1000; ++i) {
      slip.push_back(0.001 * i);
      mu.push_back(s.tyre.friction(slip.back()));
    }
    const auto peak = std::max_element(mu.begin(), mu.end());
    const double peak_slip = slip[static_cast<std::size_t>(peak - mu.begin())];
    figure.line(std::string(s.name), slip, mu, line_of(k++));
    table.rows.push_back({std::string(s.name), fmt::format("{}", s.tyre.b), fmt::format("{}", s.tyre.c),
                          fmt::format("{}", s.tyre.d), fmt::format("{}", s.tyre.e),
                          fmt::format("{:.3g}", s.tyre.b * s.tyre.c * s.tyre.d), fmt::format("{:.4f}", *peak),
                          fmt::format("{:.3f}", peak_slip)});
    // With C > 1 the sine reaches 1, so the peak is D: a check of the formula, not of a printed curve.
    o.rows.push_back(met("Fig. 1", fmt::format("peak friction, {}", s.name), "", Printed(fmt::format("{:.2f}", s.tyre.d)),
                         *peak, 1e-3, "", "the peak is D (Table 1) wherever the sine reaches 1"));
  }
  o.figures.push_back(
      figure.finish("Eq. 3.3 with the coefficients of Table 1. Snow and ice peak far beyond the 15 to 20 % slip "
                    "that the text names; on dry asphalt the curve falls off after its peak."));
  o.tables.push_back({"Table 1", "As printed in the document, and as every tyre of this bench uses them.", table});
  bench.progress(1, 1);
}

}  // namespace slipstream
