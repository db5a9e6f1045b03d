// What every page has in common: its head with the one style sheet, for the screen and for print; no external asset.
#pragma once

#include <string>

namespace slipstream {

// Up to and with <body>. The title must be escaped.
std::string page_head(const std::string& title);

// A section's figure: the picture or, if it could not be drawn, why not. All but `picture` are escaped here.
std::string page_figure(const std::string& id, const std::string& picture, const std::string& label,
                        const std::string& caption);

}  // namespace slipstream
