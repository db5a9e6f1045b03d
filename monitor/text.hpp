// Text that came from the bus or from a file is hostile until it has passed one of these.
#pragma once

#include <string>
#include <string_view>

namespace slipstream {

// 1 to 64 characters of [A-Za-z0-9_.-]: the only names that may reach gnuplot, a CSV header or a JSON key.
bool is_safe_name(std::string_view name);

// One line of plain_line ASCII for the terminal: everything else becomes '?', what is longer than `limit` is cut.
std::string plain_line(std::string_view text, std::size_t limit = 64);

// A unit for an axis: "1" and "" become "-", "^2" becomes a superscript; an unusual one becomes "?".
std::string unit_label(std::string_view unit);

// "wheel_speed_radps" -> "wheel speed": the name without its unit suffix. Only for safe names.
std::string readable_name(std::string_view name);

// readable_name and unit_label: "wheel speed (rad/s)". An empty unit is taken from the name's suffix.
std::string axis_label(std::string_view name, std::string_view unit);

// Text for HTML, in content and in attributes.
std::string html_escape(std::string_view text);

// In lines of at most `width` characters, broken between words; the second and later ones are indented by `indent`.
std::string wrapped(std::string_view text, std::size_t width, std::size_t indent);

// A number for a table: `digits` significant ones, "-" for a value that is not finite.
std::string number_text(double value, int digits = 4);

}  // namespace slipstream
