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
  // Table 1 as printed: B, C, D, E.
  static constexpr const char* kPrinted[][4] = {
      {"10", "1.9", "1", "0.97"}, {"12", "2.3", "0.82", "1"}, {"5", "2", "0.3", "1"}, {"4", "2", "0.1", "1"}};
  std::size_t k = 0;
  for (const Surface& s : kSurfaces) {
    const double ours[] = {s.tyre.b, s.tyre.c, s.tyre.d, s.tyre.e};
    for (std::size_t i = 0; i < 4; ++i)
      o.rows.push_back(met("Table 1", fmt::format("{}, {}", "BCDE"[i], s.name), "", Printed(std::stod(kPrinted[k][i]), 1e-9),
                           ours[i], 0.0, "this bench has another value"));
    std::vector<double> slip, mu;
    for (int i = 0; i <= 1000; ++i) {
      slip.push_back(0.001 * i);
      mu.push_back(s.tyre.friction(slip.back()));
    }
    const auto peak = std::max_element(mu.begin(), mu.end());
    const double peak_slip = slip[static_cast<std::size_t>(peak - mu.begin())];
    figure.line(std::string(s.name), slip, mu, line_of(k));
    table.rows.push_back({std::string(s.name), fmt::format("{}", s.tyre.b), fmt::format("{}", s.tyre.c),
                          fmt::format("{}", s.tyre.d), fmt::format("{}", s.tyre.e),
                          fmt::format("{:.3g}", s.tyre.b * s.tyre.c * s.tyre.d), fmt::format("{:.4f}", *peak),
                          fmt::format("{:.3f}", peak_slip)});
    // Where C atan(...) reaches pi/2 the sine is 1 and the peak is D.
    o.rows.push_back(met("Fig. 1", fmt::format("peak friction, {}", s.name), "", Printed(std::stod(kPrinted[k][2]), 1e-9),
                         *peak, 1e-3, "",
                         "the peak is D of Table 1 wherever the sine reaches 1; the slip is scanned in steps of 0.001"));
    ++k;
  }
  o.figures.push_back(figure.finish(
      "Eq. 3.3 with the coefficients of Table 1. Snow and ice peak at a slip of 0.31 and 0.39, beyond the 15 to 20 % "
      "that the text names; on dry asphalt the curve falls off after its peak."));
  o.tables.push_back({"Table 1", "As every tyre of this bench uses them.", table});
  bench.progress(1, 1);
}

}  // namespace slipstream
