// SPDX-FileCopyrightText: 2026 the dynfilter authors
// SPDX-License-Identifier: MIT

// Fingerprints of files: they show later whether a file is still the one that was written.

#ifndef DYNFILTER_SRC_IO_FINGERPRINT_HPP
#define DYNFILTER_SRC_IO_FINGERPRINT_HPP

#include <array>
#include <cstddef>
#include <cstdint>
#include <cstdio>
#include <filesystem>
#include <fstream>
#include <optional>
#include <string>
#include <string_view>
#include <system_error>

#include "io/file_error.hpp"

namespace dynfilter::detail {

/// Formats a hash in 16 hexadecimal digits.
inline std::string hash_text(std::uint64_t hash) {
  std::array<char, 17> text{};
  std::snprintf(text.data(), text.size(), "%016jx", std::uintmax_t{hash});
  return text.data();
}

/// The number of a file's bytes, and their 64-bit FNV-1a hash.
struct Fingerprint {
  std::uintmax_t size = 0;
  std::uint64_t hash = 0xCBF29CE484222325U;

  /// Continues with the bytes that follow.
  void add(std::string_view bytes) {
    size += bytes.size();
    for (const char byte : bytes) {
      hash ^= static_cast<unsigned char>(byte);
      hash *= 0x100000001B3U;
    }
  }

  /// Formats "<size>/<hash>", the hash in 16 hexadecimal digits.
  std::string text() const { return std::to_string(size) + '/' + hash_text(hash); }

  friend bool operator==(const Fingerprint& a, const Fingerprint& b) {
    return a.size == b.size && a.hash == b.hash;
  }
};

inline Fingerprint fingerprint_of(std::string_view bytes) {
  Fingerprint fingerprint;
  fingerprint.add(bytes);
  return fingerprint;
}

/// Reads a regular file. Throws std::runtime_error that names it.
inline Fingerprint fingerprint_of_file(const std::filesystem::path& file) {
  std::ifstream stream(file, std::ios::binary);
  Fingerprint fingerprint;
  std::array<char, 65536> bytes{};
  while (stream) {
    stream.read(bytes.data(), bytes.size());
    fingerprint.add({bytes.data(), static_cast<std::size_t>(stream.gcount())});
  }
  if (!stream.eof()) throw_file_error(file, "cannot be read");
  return fingerprint;
}

/// Parses the hash of Fingerprint::text or hash_text.
inline std::optional<std::uint64_t> parse_hash(const std::string& text) {
  if (text.size() != 16 || text.find_first_not_of("0123456789abcdef") != std::string::npos)
    return {};
  return std::stoull(text, nullptr, 16);
}

}  // namespace dynfilter::detail

#endif  // DYNFILTER_SRC_IO_FINGERPRINT_HPP
