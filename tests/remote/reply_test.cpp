// SPDX-FileCopyrightText: 2026 the dynfilter authors
// SPDX-License-Identifier: MIT

#include "remote/reply.hpp"

#include "support/test.hpp"

namespace dynfilter::testing {
namespace {

using detail::remote::read_reply;

TEST(RemoteReply, RefusesWhatItMayNotSay) {
  const std::string begin = R"({"request": 7, "instances": )";
  std::string many = "[{}";
  for (int i = 0; i < 1000; ++i) many += ", {}";
  const std::pair<std::string, std::string> table[] = {
      {begin + R"([{"score": 1.001}]})", "score of instance 0 1.001; want 0 to 1"},
      {begin + R"([{}, {"score": -0.1}]})", "score of instance 1 -0.1; want 0 to 1"},
      {begin + R"([{"score": NaN}]})", "parse error"},
      {begin + R"([{"score": 1e999}]})", "number overflow"},
      {begin + R"([{"score": "1"}]})", "must be number"},
      {begin + R"([{"class_id": 0.5}]})", "class_id of instance 0 0.5; want a whole number"},
      {begin + R"([{"class_id": 1e18}]})", "class_id of instance 0 1e+18; want"},
      {begin + R"([{"track_id": null}]})", "must be number"},
      {begin + R"([{"box": [0, 0, -1, 1]}]})", "box of instance 0 -1; want 0 to"},
      {begin + R"([{"box": [-1048577, 0, 1, 1]}]})", "box of instance 0"},
      {begin + R"([{"box": [0, 0, 1, 1048577]}]})", "box of instance 0"},
      {begin + R"([{"box": [0, 0, 1]}]})", "box of instance 0 of 3 numbers"},
      {begin + R"([{"box": {"a": 0, "b": 0, "c": 1, "d": 1}}]})", "cannot use at() with object"},
      {begin + R"([{"mask": [-1, 0, 2, 1]}]})", "2x1 at -1,0; want it in the image of 16x12"},
      {begin + R"([{"mask": [15, 0, 2, 1]}]})", "want it in the image"},
      {begin + R"([{"mask": [0, 11, 1, 2]}]})", "want it in the image"},
      {begin + R"([{"mask": [0, 0, 0, 0]}]})", "want it in the image"},
      {begin + R"([{"mask": [0, 0, 1048576, 1048576]}]})", "want it in the image"},
      {begin + R"([{"mask": [0, 0, 4, 1]}]})", "and in 3 bytes"},
      {begin + R"([{"mask": [0, 0, 2, 1]}]})", "1 bytes after the last mask"},
      {begin + "[7]}", "cannot use value() with number"},
      {begin + "{}}", "0 instances; want an array"},
      {begin + many + "]}", "1001 instances; want an array of at most 1000"},
      {R"({"request": 8, "instances": []})", "to another request than 7"},
      {R"({"request": 7, "error": 7})", "must be string"},
      {R"({"request": 7})", "'instances' not found"},
      {"[]", "cannot use at() with array"},
      {"", "parse error"},
      {std::string((1 << 20) + 1, ' '), "a header of 1048577 bytes"},
  };
  for (const auto& [header, part] : table) {
    SCOPED_TRACE(header.substr(0, 99));
    const auto read = [text = header] { read_reply(text, "123", 7, {16, 12}); };
    expect_error<detail::remote::Failure>(read, "malformed reply: ");
    expect_error<detail::remote::Failure>(read, part);
  }
}

}  // namespace
}  // namespace dynfilter::testing
