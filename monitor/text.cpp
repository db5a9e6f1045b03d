#include "monitor/text.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>

namespace slipstream {
namespace {

bool is_alphanumeric(char c) { return (c >= 'a' && c <= 'z') || (c >= 'A' && c <= 'Z') || (c >= '0' && c <= '9'); }

struct Suffix {
  std::string_view text, unit;
};

// The unit suffix that a name ends with; null if none.
const Suffix* suffix_of(std::string_view name) {
  static constexpr std::array<Suffix, 14> kSuffixes{{{"_mps2", "m/s^2"},
                                                     {"_npr", "N/rad"},
                                                     {"_mps", "m/s"},
                                                     {"_radps2", "rad/s^2"},
                                                     {"_radps", "rad/s"},
                                                     {"_rad", "rad"},
                                                     {"_nm", "N m"},
                                                     {"_rpm", "rpm"},
                                                     {"_m", "m"},
                                                     {"_kg", "kg"},
                                                     {"_n", "N"},
                                                     {"_s", "s"},
                                                     {"_hz", "Hz"},
                                                     {"_w", "W"}}};
  for (const Suffix& suffix : kSuffixes)
    if (name.size() > suffix.text.size() && name.ends_with(suffix.text)) return &suffix;
  return nullptr;
}

void replace_all(std::string& text, std::string_view from, std::string_view to) {
  for (std::size_t at = text.find(from); at != std::string::npos; at = text.find(from, at + to.size()))
    text.replace(at, from.size(), to);
}

}  // namespace

bool is_safe_name(std::string_view name) {
  return !name.empty() && name.size() <= 64 &&
         std::all_of(name.begin(), name.end(), [](char c) { return is_alphanumeric(c) || c == '_' || c == '.' || c == '-'; });
}

std::string plain_line(std::string_view text, std::size_t limit) {
  std::string result(text.substr(0, limit));
  for (char& c : result)
    if (c < ' ' || c > '~') c = '?';
  return result;
}

std::string unit_label(std::string_view unit) {
  if (unit.empty() || unit == "1") return "-";
  const bool usual = unit.size() <= 24 && std::all_of(unit.begin(), unit.end(), [](char c) {
                       return is_alphanumeric(c) || c == ' ' || c == '/' || c == '^' || c == '*' || c == '%' || c == '-';
                     });
  if (!usual) return "?";
  std::string label(unit);
  replace_all(label, "^2", "\u00b2");
  replace_all(label, "^3", "\u00b3");
  return label;
}

std::string readable_name(std::string_view name) {
  if (const Suffix* suffix = suffix_of(name)) name.remove_suffix(suffix->text.size());
  std::string text(name);
  // "a_x" keeps its underscore: a one-letter word is an index or a symbol.
  for (std::size_t i = 1; i + 1 < text.size(); ++i) {
    const bool symbol_before = i == 1 || text[i - 2] == ' ' || text[i - 2] == '_';
    if (text[i] == '_' && !symbol_before) text[i] = ' ';
  }
  return text;
}

std::string axis_label(std::string_view name, std::string_view unit) {
  const Suffix* suffix = suffix_of(name);
  return fmt::format("{} ({})", readable_name(name), unit_label(unit.empty() && suffix ? suffix->unit : unit));
}

std::string html_escape(std::string_view text) {
  std::string result;
  result.reserve(text.size());
  for (const char c : text) {
    switch (c) {
      case '&':
        result += "&amp;";
        break;
      case '<':
        result += "&lt;";
        break;
      case '>':
        result += "&gt;";
        break;
      case '"':
        result += "&quot;";
        break;
      case '\'':
        result += "&#39;";
        break;
      default:
        result += c;
    }
  }
  return result;
}

std::string wrapped(std::string_view text, std::size_t width, std::size_t indent) {
  std::string result;
  std::size_t room = width;
  while (text.size() > room) {
    const std::size_t space = text.substr(0, room + 1).rfind(' ');
    if (space == std::string_view::npos || space == 0) break;
    result += std::string(text.substr(0, space)) + "\n" + std::string(indent, ' ');
    text.remove_prefix(space + 1);
    room = width > indent ? width - indent : 1;
  }
  return result + std::string(text);
}

std::string number_text(double value, int digits) {
  if (!std::isfinite(value)) return "-";
  return fmt::format("{:.{}g}", value, digits);
}

}  // namespace slipstream
