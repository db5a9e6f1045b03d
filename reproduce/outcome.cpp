#include "reproduce/outcome.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>

namespace slipstream {
namespace {

Row described(const std::string& item, const std::string& quantity, const std::string& unit, const std::vector<double>& ours,
              const std::string& note) {
  Row row;
  row.item = item;
  row.quantity = quantity;
  row.unit = unit;
  row.ours = median(ours);
  row.runs = static_cast<int>(ours.size());
  if (ours.size() > 1 && std::none_of(ours.begin(), ours.end(), [](double v) { return std::isnan(v); }))
    row.spread = Band{percentile(ours, 0.05), percentile(ours, 0.95)};
  row.note = note;
  return row;
}

}  // namespace

Printed::Printed(const std::string& text) : value(std::stod(text)), resolution(1.0) {
  const std::size_t exponent = text.find('e');
  const std::string digits = text.substr(0, exponent);
  if (const std::size_t point = digits.find('.'); point != std::string::npos)
    resolution = std::pow(10.0, -static_cast<double>(digits.size() - point - 1));
  if (exponent != std::string::npos) resolution *= std::pow(10.0, std::stod(text.substr(exponent + 1)));
}

double median(std::vector<double> values) {
  if (values.empty() || std::any_of(values.begin(), values.end(), [](double v) { return std::isnan(v); }))
    return std::numeric_limits<double>::quiet_NaN();
  std::sort(values.begin(), values.end());
  const std::size_t n = values.size();
  return n % 2 == 1 ? values[n / 2] : 0.5 * (values[n / 2 - 1] + values[n / 2]);
}

Row judged(const std::string& item, const std::string& quantity, const std::string& unit, const Printed& published, Aim aim,
           const std::vector<double>& ours, const std::string& because, const std::string& note) {
  Row row = described(item, quantity, unit, ours, note);
  row.published = published.value;
  if (std::isnan(row.ours)) {
    row.verdict = "not computed: some run gave no number";
    return row;
  }
  const double sign = aim == Aim::kHigh ? 1.0 : -1.0;
  const double slack = 0.5 * published.resolution * (1.0 + 1e-9);
  const double gain = sign * (row.ours - published.value);  // positive: ours is better
  const Band spread = row.spread.value_or(Band{row.ours, row.ours});
  const bool inside = published.value >= spread.low - slack && published.value <= spread.high + slack;
  if (inside || std::abs(gain) <= slack)
    row.verdict = row.spread ? "equal within spread" : "equal to the printed digit";
  else if (gain > 0.0)
    row.verdict = "better";
  else
    row.verdict = "worse, because " + (because.empty() ? "of a reason that we have not found" : because);
  return row;
}

Row met(const std::string& item, const std::string& quantity, const std::string& unit, const Printed& published, double ours,
        double tolerance, const std::string& because, const std::string& note) {
  Row row = described(item, quantity, unit, {ours}, note);
  row.published = published.value;
  if (std::isnan(ours))
    row.verdict = "not computed";
  else if (std::abs(ours - published.value) > tolerance + 0.5 * published.resolution * (1.0 + 1e-9))
    row.verdict = "different, because " + (because.empty() ? "of a reason that we have not found" : because);
  else
    row.verdict = tolerance > 0.0 ? fmt::format("met within {:g}{}", tolerance, unit.empty() ? "" : " " + unit)
                                  : "met to the printed digit";
  return row;
}

Row reported(const std::string& item, const std::string& quantity, const std::string& unit, const std::vector<double>& ours,
             const std::string& note) {
  Row row = described(item, quantity, unit, ours, note);
  row.verdict = "no published value";
  return row;
}

void add_parameters(Outcome& o, const std::string& item, const std::string& title, const std::string& caption,
                    const std::vector<Parameter>& parameters) {
  Table table{title, {{"parameter", false}, {"printed"}, {"ours"}, {"unit", false}}, {}};
  for (const Parameter& p : parameters) {
    table.rows.push_back({p.name, p.printed, fmt::format("{:g}", p.ours), p.unit});
    o.rows.push_back(
        met(item, p.name, p.unit, Printed(std::stod(p.printed), 1e-9), p.ours, 0.0, "this bench has another value"));
  }
  o.tables.push_back({item, caption, table});
}

}  // namespace slipstream
