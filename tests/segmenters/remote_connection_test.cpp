// SPDX-FileCopyrightText: 2026 the dynfilter authors
// SPDX-License-Identifier: MIT

// What the connection to another process does if the system cannot send.

#include "segmenters/remote/connection.hpp"

#include <sys/socket.h>
#include <sys/types.h>

#include <cerrno>
#include <cstdint>
#include <deque>
#include <vector>

#include <gtest/gtest.h>

#include "support/expect_error.hpp"
#include "support/remote_peer.hpp"
#include "support/temporary_folder.hpp"

namespace {
std::deque<int> errors_to_come;  // of the next calls of send(); afterwards it works
}

// Replaces the C library's function.
extern "C" ssize_t send(int socket, const void* bytes, size_t size, int flags) {
  if (errors_to_come.empty()) return ::sendto(socket, bytes, size, flags, nullptr, 0);
  errno = errors_to_come.front();
  errors_to_come.pop_front();
  return -1;
}

namespace dynfilter::detail::remote {
namespace {

class RemoteConnection : public ::testing::Test {
 protected:
  RemoteConnection()
      : listener_(testing::PeerSocket::listening(folder_ / "socket")),
        connection_(*Connection::to((folder_ / "socket").string(), Deadline(10))),
        peer_(listener_.accepted()) {}

  bool send(const std::vector<std::uint8_t>& bytes) {
    return connection_.send(bytes, {}, Deadline(10));
  }

  testing::TemporaryFolder folder_;
  testing::PeerSocket listener_;
  Connection connection_;
  testing::PeerSocket peer_;
};

TEST_F(RemoteConnection, ASignalOrAFullBufferLosesNothing) {
  const std::vector<std::uint8_t> bytes = {1, 2, 3, 4, 5};
  errors_to_come = {EINTR, EINTR, EAGAIN, EINTR};
  EXPECT_TRUE(send(bytes));
  EXPECT_TRUE(errors_to_come.empty());
  EXPECT_EQ(peer_.receive(bytes.size()), bytes);
}

TEST_F(RemoteConnection, AClosedOneIsNoError) {
  for (const int error : {EPIPE, ECONNRESET}) {
    errors_to_come = {error};
    EXPECT_FALSE(send({1}));
  }
}

TEST_F(RemoteConnection, AnyOtherErrorIsNamed) {
  errors_to_come = {ENOBUFS};
  testing::expect_error<ConnectionError>([&] { send({1}); }, "cannot send");
  EXPECT_TRUE(errors_to_come.empty());
}

}  // namespace
}  // namespace dynfilter::detail::remote
