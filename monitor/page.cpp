#include "monitor/page.hpp"

#include <fmt/format.h>

#include "monitor/text.hpp"

namespace slipstream {
namespace {

constexpr const char* kStyle = R"(
:root { color-scheme: light; }
body { font: 16px/1.5 system-ui, -apple-system, "Segoe UI", "DejaVu Sans", sans-serif; color: #1a1a1a; background: #fff;
       max-width: 62rem; margin: 2rem auto; padding: 0 1rem; }
h1 { font-size: 1.7rem; margin: 0 0 .2rem; } h2 { font-size: 1.25rem; margin: 2.2rem 0 .6rem; border-bottom: 1px solid #bbb; }
p.lead { margin: 0 0 1rem; color: #333; } .warning { border-left: 4px solid #D55E00; padding: .3rem .8rem; background: #fdf3ec; }
dl { display: grid; grid-template-columns: max-content 1fr; gap: .15rem 1.2rem; margin: 0; } dt { color: #555; } dd { margin: 0; }
.scroll { overflow-x: auto; }
table { border-collapse: collapse; margin: .8rem 0 1.4rem; font-size: .94rem; font-variant-numeric: tabular-nums; }
caption { text-align: left; font-weight: 600; padding: .2rem 0; }
th, td { padding: .22rem 1.3rem .22rem 0; text-align: left; vertical-align: top; } th { border-bottom: 1.5px solid #333; }
tbody tr + tr td { border-top: 1px solid #ddd; } .number { text-align: right; white-space: nowrap; }
figure { margin: 1.4rem 0 2rem; } figure svg { width: 100%; height: auto; display: block; }
figcaption { margin-top: .5rem; font-size: .92rem; color: #333; } figcaption b { color: #1a1a1a; }
details pre { font-size: .82rem; background: #f6f6f6; padding: .8rem; overflow-x: auto; }
@media print {
  @page { margin: 15mm; }
  body { font-size: 10.5pt; max-width: none; margin: 0; padding: 0; color: #000; }
  h2 { break-after: avoid; } figure, table { break-inside: avoid; } .scroll { overflow: visible; }
  table { font-size: 9pt; } details { display: none; } figcaption { color: #000; }
}
)";

}  // namespace

std::string page_head(const std::string& title) {
  return fmt::format(
      "<!DOCTYPE html>\n<html lang=\"en\">\n<head>\n<meta charset=\"utf-8\">\n"
      "<meta name=\"viewport\" content=\"width=device-width, initial-scale=1\">\n"
      "<title>{}</title>\n<style>{}</style>\n</head>\n<body>\n",
      title, kStyle);
}

std::string page_figure(const std::string& id, const std::string& picture, const std::string& label,
                        const std::string& caption) {
  return fmt::format("<figure id=\"{}\">\n{}\n<figcaption><b>{}</b> {}</figcaption>\n</figure>\n", html_escape(id), picture,
                     html_escape(label), html_escape(caption));
}

}  // namespace slipstream
