// Whole text files, and found text made fit for an error line.
#pragma once

#include <cerrno>
#include <cstdio>
#include <cstring>
#include <memory>
#include <string>
#include <string_view>

#include "common/refusal.hpp"

namespace slipstream {

// Refuses, with `prefix` before the message, a file that cannot be opened or read.
inline std::string read_text_file(const std::string& path, const std::string& prefix = "") {
  const auto refuse = [&](int error) {
    throw Refusal(prefix + (prefix.empty() ? path + ": cannot read" : "cannot read '" + path + "'") + ": " +
                  std::strerror(error));
  };
  const std::unique_ptr<std::FILE, int (*)(std::FILE*)> file(std::fopen(path.c_str(), "rb"), &std::fclose);
  if (!file) refuse(errno);
  std::string text;
  char buffer[65536];
  while (const std::size_t count = std::fread(buffer, 1, sizeof buffer, file.get())) text.append(buffer, count);
  if (std::ferror(file.get())) refuse(errno);
  return text;
}

// At most 40 bytes, with control characters as '?'.
inline std::string printable(std::string_view text) {
  std::string result(text.substr(0, 40));
  for (char& c : result)
    if (static_cast<unsigned char>(c) < 0x20 || c == 0x7f) c = '?';
  return text.size() > 40 ? result + "..." : result;
}

}  // namespace slipstream
