// The figures of the report: which series stands in which panel.
#pragma once

#include <string>
#include <vector>

#include "monitor/results.hpp"

namespace slipstream {

struct Figure {
  std::string id;     // unique in the page, safe
  std::string title;  // also the picture's alternative text
  std::string caption;
  std::string script;  // for gnuplot
};

std::vector<Figure> make_figures(const Results& results);

}  // namespace slipstream
