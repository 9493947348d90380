// SPDX-FileCopyrightText: 2026 the dynfilter authors
// SPDX-License-Identifier: MIT

#include "remote/reply.hpp"

#include "support/test.hpp"

namespace dynfilter::testing {
namespace {

using detail::remote::read_reply;

TEST(RemoteReply, RefusesWhatItMayNotSay) {
  const auto reply_of = [](const std::string& rows) {
    return R"({"request": 7, "instances": )" + rows + "}";
  };
  std::string many = "[{}";
  for (int i = 0; i < 1000; ++i) many += ", {}";
  const std::pair<std::string, std::string> table[] = {
      {reply_of(R"([{"score": 1.001}])"), "score of instance 0 1.001; want 0 to 1"},
      {reply_of(R"([{}, {"score": -0.1}])"), "score of instance 1 -0.1; want 0 to 1"},
      {reply_of(R"([{"score": NaN}])"), "parse error"},
      {reply_of(R"([{"score": 1e999}])"), "number overflow"},
      {reply_of(R"([{"score": "1"}])"), "must be number"},
      {reply_of(R"([{"class_id": 0.5}])"), "class_id of instance 0 0.5; want a whole number"},
      {reply_of(R"([{"class_id": 1e18}])"), "class_id of instance 0 1e+18; want"},
      {reply_of(R"([{"track_id": null}])"), "must be number"},
      {reply_of(R"([{"box": [0, 0, -1, 1]}])"), "box of instance 0 -1; want 0 to"},
      {reply_of(R"([{"box": [-1048577, 0, 1, 1]}])"), "box of instance 0"},
      {reply_of(R"([{"box": [0, 0, 1, 1048577]}])"), "box of instance 0"},
      {reply_of(R"([{"box": [0, 0, 1]}])"), "box of instance 0 of 3 numbers"},
      {reply_of(R"([{"box": {"a": 0, "b": 0, "c": 1, "d": 1}}])"), "cannot use at() with object"},
      {reply_of(R"([{"mask": [-1, 0, 2, 1]}])"), "2x1 at -1,0; want it in the image of 16x12"},
      {reply_of(R"([{"mask": [15, 0, 2, 1]}])"), "want it in the image"},
      {reply_of(R"([{"mask": [0, 11, 1, 2]}])"), "want it in the image"},
      {reply_of(R"([{"mask": [0, 0, 0, 0]}])"), "want it in the image"},
      {reply_of(R"([{"mask": [0, 0, 1048576, 1048576]}])"), "want it in the image"},
      {reply_of(R"([{"mask": [0, 0, 4, 1]}])"), "and in 3 bytes"},
      {reply_of(R"([{"mask": [0, 0, 2, 1]}])"), "1 bytes after the last mask"},
      {reply_of("[7]"), "cannot use value() with number"},
      {reply_of("{}"), "0 instances; want an array"},
      {reply_of(many + "]"), "1001 instances; want an array of at most 1000"},
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
