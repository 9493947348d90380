// SPDX-FileCopyrightText: 2026 the dynfilter authors
// SPDX-License-Identifier: MIT

#ifndef DYNFILTER_SRC_TOOLS_SEQUENCE_CHECKS_HPP
#define DYNFILTER_SRC_TOOLS_SEQUENCE_CHECKS_HPP

#include <filesystem>
#include <string>
#include <vector>

namespace dynfilter::tools {

/// Verdict on one property of a recording.
enum class Verdict {
  fine,   ///< as it should be
  odd,    ///< usable, but look at it
  broken  ///< not usable before it is mended
};

/// What was found out about one property.
struct Finding {
  Verdict verdict = Verdict::fine;
  std::string what;  ///< what was found, one line
  std::string mend;  ///< what to do about it; empty if nothing
};

/// Examines a sequence folder in the layout of TUM or BONN, from its lists to the depth's offset.
/// Looks at all files' names, lengths and times, and at about 20 frames; only reads. An empty
/// camera path means camera.yaml in the folder. Throws nothing for a bad sequence: that is a
/// finding.
std::vector<Finding> examine_sequence(const std::filesystem::path& folder,
                                      const std::filesystem::path& camera = {});

}  // namespace dynfilter::tools

#endif  // DYNFILTER_SRC_TOOLS_SEQUENCE_CHECKS_HPP
