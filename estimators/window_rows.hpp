// What a window keeps of its samples, in rows of numbers that slide: row r of sample i is a plain array over i, so that packs
// load several samples at once. Nothing moves when the window slides, save once in many samples.
#pragma once

#include <algorithm>
#include <vector>

namespace slipstream {

template <int kRows>
class WindowRows {
 public:
  static constexpr int kLanes = 8;  // so many numbers may be loaded from any sample on, those past the end without meaning

  // most: samples at a time
  explicit WindowRows(int most)
      : stride_(std::max(4 * most, 64) + 2 * kLanes), data_(static_cast<std::size_t>(kRows * stride_)) {}

  int size() const { return size_; }
  double& operator()(int row, int i) { return data_[index(row, i)]; }
  double operator()(int row, int i) const { return data_[index(row, i)]; }
  const double* from(int row, int i) const { return data_.data() + index(row, i); }

  void clear() { first_ = size_ = 0; }
  void push() {
    if (first_ + size_ + 2 * kLanes > stride_) {
      for (int r = 0; r < kRows; ++r) {
        const auto row = data_.begin() + static_cast<std::ptrdiff_t>(r) * stride_;
        std::copy(row + first_, row + first_ + size_, row);
      }
      first_ = 0;
    }
    ++size_;
  }
  void pop() { ++first_, --size_; }

 private:
  std::size_t index(int row, int i) const { return static_cast<std::size_t>(row * stride_ + first_ + i); }

  int stride_, first_ = 0, size_ = 0;
  std::vector<double> data_;
};

}  // namespace slipstream
