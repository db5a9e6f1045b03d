// Checks the byte layout of an encoded LCM message before it is decoded.
//
// The generated decoders trust the counts in a message: a negative one throws through C code, a huge one allocates gigabytes.
// Here a message must have exactly the bytes that its counts announce.
#pragma once

#include <cstddef>
#include <cstdint>
#include <string_view>

namespace slipstream {

// `layout`, one letter a field, after the 8 bytes of the type's hash:
//   q int64   d double   b int8   s string   n int32 count, which the following letters use:
//   B n int8   D n doubles   M n x n doubles   S n strings
// True if the data has that layout and nothing more; counts from 0 to 4096.
bool fits_layout(const void* data, std::size_t size, std::string_view layout);

}  // namespace slipstream
