#include "io/layout.hpp"

namespace slipstream {

namespace {

constexpr std::int32_t kMaxCount = 4096;

class Cursor {
 public:
  Cursor(const unsigned char* at, std::size_t left) : at_(at), left_(left) {}

  bool skip(std::size_t bytes) {
    if (bytes > left_) return false;
    at_ += bytes;
    left_ -= bytes;
    return true;
  }
  bool read(std::int32_t& value) {
    if (left_ < 4) return false;
    value = static_cast<std::int32_t>(static_cast<std::uint32_t>(at_[0]) << 24 | static_cast<std::uint32_t>(at_[1]) << 16 |
                                      static_cast<std::uint32_t>(at_[2]) << 8 | at_[3]);
    return skip(4);
  }
  // Length with the closing NUL, then the bytes.
  bool skip_string() {
    std::int32_t length = 0;
    if (!read(length) || length < 1 || static_cast<std::size_t>(length) > left_) return false;
    return at_[length - 1] == 0 && skip(static_cast<std::size_t>(length));
  }
  bool at_end() const { return left_ == 0; }

 private:
  const unsigned char* at_;
  std::size_t left_;
};

}  // namespace

bool fits_layout(const void* data, std::size_t size, std::string_view layout) {
  Cursor cursor(static_cast<const unsigned char*>(data), size);
  if (!cursor.skip(8)) return false;
  std::int32_t count = 0;
  for (const char field : layout) {
    const auto n = static_cast<std::size_t>(count);
    bool fits = true;
    switch (field) {
      case 'q':
      case 'd':
        fits = cursor.skip(8);
        break;
      case 'b':
        fits = cursor.skip(1);
        break;
      case 'B':
        fits = cursor.skip(n);
        break;
      case 's':
        fits = cursor.skip_string();
        break;
      case 'n':
        fits = cursor.read(count) && count >= 0 && count <= kMaxCount;
        break;
      case 'D':
        fits = cursor.skip(8 * n);
        break;
      case 'M':
        fits = cursor.skip(8 * n * n);
        break;
      case 'S':
        for (std::size_t i = 0; i < n && fits; ++i) fits = cursor.skip_string();
        break;
      default:
        return false;
    }
    if (!fits) return false;
  }
  return cursor.at_end();
}

}  // namespace slipstream
