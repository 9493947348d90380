// SPDX-FileCopyrightText: 2026 the dynfilter authors
// SPDX-License-Identifier: MIT

// The program with a real network, from image to trajectory.

#include <gtest/gtest.h>

#include "support/program.hpp"
#include "support/temporary_folder.hpp"
#include "support/test_data.hpp"

namespace dynfilter::testing {
namespace {

class SlowProgramWithNetwork : public RecordedData {
 protected:
  void SetUp() override {
    RecordedData::SetUp();
    if (IsSkipped()) return;
    sequence_ = data("tum_fr3_walking_halfsphere_50");
    model_ = sequence_.parent_path().parent_path() / "models" / "yolov8n-seg-raw-heads.onnx";
    if (!fs::exists(model_)) GTEST_SKIP() << "DYNFILTER_DATA_DIR has no " << model_;
  }

  /// Summary that `dynfilter run` writes for the sequence with the network.
  nlohmann::json summary_of(const std::string& options) const {
    const fs::path out = folder_.path() / "out";
    const Outcome outcome = run("run " + quoted(sequence_) + " --model " + quoted(model_) +
                                " --overlays 0 --out " + quoted(out) + options);
    EXPECT_EQ(outcome.exit_code, 0) << outcome.printed;
    return read_json(out / "summary.json");
  }

  fs::path sequence_, model_;
  TemporaryFolder folder_;
};

TEST_F(SlowProgramWithNetwork, TracksTheCameraDespitePersons) {
  const nlohmann::json summary = summary_of("");
  EXPECT_GT(summary["masked"], 49 * 150);
  EXPECT_EQ(summary["lost_frames"], 0);
  EXPECT_LT(summary["ate_rmse_m"], 0.03) << "0.22 m with all features";
}

}  // namespace
}  // namespace dynfilter::testing
