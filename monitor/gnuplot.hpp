// Runs gnuplot: a script into its standard input, an SVG picture out of its standard output. No shell, no file, no settings of
// the user, a time limit.
#pragma once

#include <string>

namespace slipstream {

struct Drawing {
  bool installed = true;  // false: there is no gnuplot
  std::string svg;        // empty: it failed, `error` says how
  std::string error;
};

Drawing draw(const std::string& script, double limit_s = 20.0);

// The picture ready to stand inside an HTML page: without prolog and foreign namespaces, every id prefixed so that pictures do
// not meet, with our title instead of gnuplot's.
std::string inline_svg(const std::string& svg, const std::string& prefix, const std::string& title);

}  // namespace slipstream
