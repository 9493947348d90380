// SPDX-FileCopyrightText: 2026 the dynfilter authors
// SPDX-License-Identifier: MIT

#ifndef DYNFILTER_TESTS_SUPPORT_ANSWER_HPP
#define DYNFILTER_TESTS_SUPPORT_ANSWER_HPP

#include <cstddef>
#include <cstdint>
#include <cstdlib>
#include <optional>
#include <stdexcept>
#include <string>
#include <vector>

#include <gtest/gtest.h>
#include <opencv2/core.hpp>

#include "dynfilter/instance.hpp"
#include "dynfilter/labels.hpp"
#include "support/failing_allocations.hpp"

namespace dynfilter::testing {

/// Memory that FailingAllocation does not count, so that only what is tested fails.
template <class Value>
struct UncountedAllocator {
  using value_type = Value;

  UncountedAllocator() = default;
  template <class Other>
  explicit UncountedAllocator(const UncountedAllocator<Other>&) {}

  Value* allocate(std::size_t count) {
    return static_cast<Value*>(std::malloc(count * sizeof(Value)));
  }
  void deallocate(Value* first, std::size_t) { std::free(first); }

  friend bool operator==(const UncountedAllocator&, const UncountedAllocator&) { return true; }
  friend bool operator!=(const UncountedAllocator&, const UncountedAllocator&) { return false; }
};

/// What a call returned, as numbers that can be compared. Collecting them does not allocate as far
/// as FailingAllocation counts.
class Answer {
 public:
  Answer& add(double number) {
    numbers_.push_back(number);
    return *this;
  }
  Answer& add(const std::string& text) {
    add(static_cast<double>(text.size()));
    for (const char c : text) add(c);
    return *this;
  }
  Answer& add(const cv::Rect& box) { return add(box.x).add(box.y).add(box.width).add(box.height); }
  Answer& add(const cv::Mat& image) {
    add(image.type()).add(cv::Rect({}, image.size()));
    for (int y = 0; y < image.rows; ++y) {
      const auto* const row = image.ptr<std::uint8_t>(y);
      numbers_.insert(numbers_.end(), row,
                      row + static_cast<std::size_t>(image.cols) * image.elemSize());
    }
    return *this;
  }
  Answer& add(const Instance& instance) {
    add(instance.class_id).add(double{instance.score}).add(instance.box);
    return add(cv::Rect(instance.mask_origin, cv::Size())).add(instance.mask);
  }
  Answer& add(const FeatureLabels& labels) {
    for (const FeatureLabel& label : labels) {
      add(label.removed ? 1 : 0).add(static_cast<int>(label.reason));
      add(label.instance).add(double{label.score});
    }
    const FrameStatistics& statistics = labels.statistics();
    for (const std::size_t count : {statistics.features, statistics.masked, statistics.compensated,
                                    statistics.restored, statistics.removed()}) {
      add(static_cast<double>(count));
    }
    return *this;
  }
  template <class Value>
  Answer& add(const std::vector<Value>& values) {
    add(static_cast<double>(values.size()));
    for (const Value& value : values) add(value);
    return *this;
  }

  friend bool operator==(const Answer& a, const Answer& b) { return a.numbers_ == b.numbers_; }

 private:
  std::vector<double, UncountedAllocator<double>> numbers_;
};

/// Lets each allocation of a call fail in turn. Expects that the call then throws, or returns the
/// answer that it gives otherwise, and that the next call gives that answer. `make` returns the
/// call, with everything that it keeps from one time to the next. Files are "cannot be read" where
/// a stream ran out of memory. Returns the number of failed allocations.
template <class Make>
std::size_t expect_right_answers(const Make& make) {
  const Answer want = make()();
  return for_each_failing_allocation([&](const std::size_t n) {
    const auto call = make();
    std::optional<Answer> got;
    const bool has_failed = fails_at_allocation(n, [&] {
      try {
        got = call();
      } catch (const std::runtime_error&) {
        if (!FailingAllocation::has_failed()) throw;
      }
    });
    EXPECT_TRUE(!got || *got == want) << "a wrong answer when allocation " << n << " failed";
    EXPECT_TRUE(call() == want) << "a wrong answer after allocation " << n << " failed";
    return has_failed && !::testing::Test::HasFailure();
  });
}

}  // namespace dynfilter::testing

#endif  // DYNFILTER_TESTS_SUPPORT_ANSWER_HPP
