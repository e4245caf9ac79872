#pragma once

#include <cstdint>
#include <filesystem>
#include <optional>
#include <string>
#include <string_view>

struct sqlite3;
struct sqlite3_stmt;

namespace shaped::server {

/// An open SQLite database. One thread at a time.
///
/// What fails throws FileError that names the file, what failed and the system's reason (a full disk, a read-only file
/// system), Corrupted when the file is damaged or no database, StoreLocked when another program locks it for ten seconds.
class Database {
 public:
  /// Opens or creates the file; ":memory:" for one that ends with the object.
  explicit Database(const std::filesystem::path& file);
  ~Database();
  Database(const Database&) = delete;
  Database& operator=(const Database&) = delete;

  const std::string& file() const { return file_; }
  /// Runs statements without parameters.
  void run(const std::string& sql);
  std::int64_t lastRow() const;
  [[noreturn]] void fail(const std::string& problem) const;

 private:
  friend class Statement;
  void close();

  const std::string file_;
  sqlite3* handle_ = nullptr;
};

/// A prepared statement. Parameters and columns count from 0.
class Statement {
 public:
  Statement(Database& database, const std::string& sql);
  ~Statement();
  Statement(const Statement&) = delete;
  Statement& operator=(const Statement&) = delete;

  void bind(int parameter, std::int64_t value);
  void bind(int parameter, double value);
  void bindText(int parameter, std::string_view value);
  void bindBytes(int parameter, std::string_view value);
  void bindNull(int parameter);

  /// Goes to the next row; false when there is none.
  bool step();

  bool isNull(int column) const;
  std::int64_t integer(int column) const;
  double real(int column) const;
  /// Text or bytes.
  std::string bytes(int column) const;

 private:
  void require(int code);

  Database& database_;
  sqlite3_stmt* handle_ = nullptr;
};

/// Rolls back what was not committed.
class Transaction {
 public:
  explicit Transaction(Database& database);
  ~Transaction();
  Transaction(const Transaction&) = delete;
  Transaction& operator=(const Transaction&) = delete;
  void commit();

 private:
  Database& database_;
  bool open_ = true;
};

}  // namespace shaped::server
