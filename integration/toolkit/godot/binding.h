#pragma once

#include <gdextension_interface.h>

#include <array>
#include <memory>
#include <span>
#include <string>
#include <string_view>
#include <type_traits>
#include <utility>
#include <vector>

/// As much of Godot's C interface as the nodes need: variants, calls by name, and classes that are
/// registered from tables. Everything here belongs to the engine's main thread.
namespace palpate::godot {

#define PALPATE_GODOT_FUNCTIONS(X)                                                               \
  X(VariantNewNil, variant_new_nil)                                                              \
  X(VariantNewCopy, variant_new_copy)                                                            \
  X(VariantDestroy, variant_destroy)                                                             \
  X(VariantCall, variant_call)                                                                   \
  X(VariantConstruct, variant_construct)                                                         \
  X(VariantGetType, variant_get_type)                                                            \
  X(VariantStringify, variant_stringify)                                                         \
  X(VariantGetPtrDestructor, variant_get_ptr_destructor)                                         \
  X(GetVariantFromTypeConstructor, get_variant_from_type_constructor)                            \
  X(GetVariantToTypeConstructor, get_variant_to_type_constructor)                                \
  X(StringNewWithUtf8CharsAndLen, string_new_with_utf8_chars_and_len)                            \
  X(StringToUtf8Chars, string_to_utf8_chars)                                                     \
  X(StringNameNewWithUtf8Chars, string_name_new_with_utf8_chars)                                 \
  X(ImagePtrw, image_ptrw)                                                                       \
  X(GlobalGetSingleton, global_get_singleton)                                                    \
  X(ObjectSetInstance, object_set_instance)                                                      \
  X(ClassdbConstructObject2, classdb_construct_object2)                                          \
  X(ClassdbRegisterExtensionClass4, classdb_register_extension_class4)                           \
  X(ClassdbRegisterExtensionClassMethod, classdb_register_extension_class_method)                \
  X(ClassdbRegisterExtensionClassSignal, classdb_register_extension_class_signal)                \
  X(ClassdbRegisterExtensionClassPropertyIndexed,                                                \
    classdb_register_extension_class_property_indexed)                                           \
  X(ClassdbRegisterExtensionClassPropertyGroup, classdb_register_extension_class_property_group) \
  X(ClassdbUnregisterExtensionClass, classdb_unregister_extension_class)                         \
  X(PrintWarning, print_warning)                                                                 \
  X(PrintError, print_error)

/// The engine's functions; filled by load_functions() before anything else here is used.
struct EngineFunctions {
#define PALPATE_GODOT_MEMBER(type, name) GDExtensionInterface##type name = nullptr;
  PALPATE_GODOT_FUNCTIONS(PALPATE_GODOT_MEMBER)
#undef PALPATE_GODOT_MEMBER
  GDExtensionsInterfaceEditorHelpLoadXmlFromUtf8Chars editor_help_load_xml_from_utf8_chars =
      nullptr;
};
extern EngineFunctions engine;
extern GDExtensionClassLibraryPtr library;

/// False if the engine lacks one of the functions (Godot before 4.4).
bool load_functions(GDExtensionInterfaceGetProcAddress find, GDExtensionClassLibraryPtr own);

/// A StringName of the engine.
class EngineName {
 public:
  explicit EngineName(const char* text) { engine.string_name_new_with_utf8_chars(&content_, text); }
  EngineName(const EngineName&) = delete;
  EngineName& operator=(const EngineName&) = delete;
  ~EngineName();
  void* get() const { return &content_; }

 private:
  mutable void* content_ = nullptr;
};

/// A String of the engine.
class EngineText {
 public:
  EngineText() = default;  ///< empty, as the engine takes a place for a result
  explicit EngineText(std::string_view text) {
    engine.string_new_with_utf8_chars_and_len(&content_, text.data(), GDExtensionInt(text.size()));
  }
  EngineText(const EngineText&) = delete;
  EngineText& operator=(const EngineText&) = delete;
  ~EngineText();
  void* get() const { return &content_; }

 private:
  mutable void* content_ = nullptr;
};

// Values of the engine, in its memory layout (real_t is float).
struct EngineVector {
  float x = 0.0F, y = 0.0F, z = 0.0F;
};
struct EngineTransform {
  float rows[3][3] = {{1.0F, 0.0F, 0.0F}, {0.0F, 1.0F, 0.0F}, {0.0F, 0.0F, 1.0F}};
  EngineVector origin;
};
struct EngineProjection {
  float columns[4][4] = {};
};

template <class T>
constexpr GDExtensionVariantType kTypeOf = GDEXTENSION_VARIANT_TYPE_NIL;
template <>
constexpr GDExtensionVariantType kTypeOf<GDExtensionBool> = GDEXTENSION_VARIANT_TYPE_BOOL;
template <>
constexpr GDExtensionVariantType kTypeOf<int64_t> = GDEXTENSION_VARIANT_TYPE_INT;
template <>
constexpr GDExtensionVariantType kTypeOf<double> = GDEXTENSION_VARIANT_TYPE_FLOAT;
template <>
constexpr GDExtensionVariantType kTypeOf<EngineVector> = GDEXTENSION_VARIANT_TYPE_VECTOR3;
template <>
constexpr GDExtensionVariantType kTypeOf<EngineTransform> = GDEXTENSION_VARIANT_TYPE_TRANSFORM3D;
template <>
constexpr GDExtensionVariantType kTypeOf<EngineProjection> = GDEXTENSION_VARIANT_TYPE_PROJECTION;
template <>
constexpr GDExtensionVariantType kTypeOf<GDExtensionObjectPtr> = GDEXTENSION_VARIANT_TYPE_OBJECT;

/// A Variant of the engine: null, a value, or a reference to an object.
class Variant {
 public:
  Variant() { engine.variant_new_nil(content_); }
  Variant(const Variant& other) { engine.variant_new_copy(content_, other.content_); }
  Variant(Variant&& other) noexcept : Variant() { std::swap(content_, other.content_); }
  Variant& operator=(Variant other) noexcept {
    std::swap(content_, other.content_);
    return *this;
  }
  ~Variant() { engine.variant_destroy(content_); }

  Variant(bool value) : Variant(GDExtensionBool(value)) {}
  Variant(int value) : Variant(int64_t(value)) {}
  Variant(std::string_view text);
  Variant(const char* text) : Variant(std::string_view(text)) {}
  Variant(const std::string& text) : Variant(std::string_view(text)) {}
  template <class T>
  requires(kTypeOf<T> != GDEXTENSION_VARIANT_TYPE_NIL) Variant(const T& value)
      : Variant(kTypeOf<T>, const_cast<std::remove_const_t<T>*>(&value)) {}
  /// A value of a type in the engine's memory.
  Variant(GDExtensionVariantType type, void* value);
  /// As the engine's constructor of that type: Variant::made(..._PACKED_BYTE_ARRAY).
  template <class... Arguments>
  static Variant made(GDExtensionVariantType type, const Arguments&... arguments) {
    const std::array<Variant, sizeof...(Arguments)> values{Variant(arguments)...};
    return made_of(type, values);
  }

  GDExtensionVariantType type() const { return engine.variant_get_type(content_); }
  bool is_null() const { return type() == GDEXTENSION_VARIANT_TYPE_NIL; }
  /// The value, T() if the variant has another type.
  template <class T>
  T as() const {
    T value{};
    if (type() == kTypeOf<T>) copy_to(&value);
    return value;
  }
  bool is_true() const { return as<GDExtensionBool>() != 0; }
  /// Of an INT or a FLOAT.
  double number() const {
    return type() == GDEXTENSION_VARIANT_TYPE_INT ? double(as<int64_t>()) : as<double>();
  }
  std::string text() const;
  /// Writes a value of its own type to the engine's memory.
  void copy_to(void* typed) const;

  /// Calls a method by its name. An error is printed, and the result null.
  template <class... Arguments>
  Variant call(const char* method, const Arguments&... arguments) const {
    const std::array<Variant, sizeof...(Arguments)> values{Variant(arguments)...};
    return call_with(method, values);
  }

  void* get() const { return const_cast<uint8_t*>(content_); }

 private:
  static Variant made_of(GDExtensionVariantType type, std::span<const Variant> arguments);
  Variant call_with(const char* method, std::span<const Variant> arguments) const;

  alignas(8) uint8_t content_[24];
};

/// A singleton of the engine.
Variant singleton(const char* name);
/// True where the scene is edited, not played.
bool in_editor();
void warn(const std::string& sentence);

using Arguments = std::span<const Variant>;

/// A node whose behaviour is here. The engine makes and deletes it.
class EngineNode {
 public:
  virtual ~EngineNode() = default;
  /// NOTIFICATION_... of the engine.
  virtual void notified(int what) = 0;
  /// The property of this place in the class's table.
  virtual Variant get(size_t property) const = 0;
  virtual void set(size_t property, const Variant& value) = 0;
  /// 0 or PROPERTY_USAGE_... bits to add to property `name` of this node.
  virtual uint32_t usage_of(const std::string&) const { return 0; }

  Variant self() const { return Variant(object); }
  template <class... Arguments>
  void emit(const char* signal, const Arguments&... arguments) const {
    self().call("emit_signal", signal, arguments...);
  }
  GDExtensionObjectPtr object = nullptr;
};

enum Notification : int {
  kEntersTree = 10,
  kLeavesTree = 11,
  kInternalProcess = 25,
  kHasEnteredTree = 27,
};

struct MethodRow {
  const char* name;
  std::vector<std::pair<const char*, GDExtensionVariantType>> arguments;
  GDExtensionVariantType returns;  ///< NIL: any or nothing
  Variant (*run)(EngineNode& node, Arguments arguments);
};
template <class Node>
Variant run_on(EngineNode& node, Arguments arguments, Variant (Node::*method)(Arguments)) {
  return (static_cast<Node&>(node).*method)(arguments);
}
/// A member function as MethodRow::run.
template <auto Method>
Variant run(EngineNode& node, Arguments arguments) {
  return run_on(node, arguments, Method);
}
struct SignalRow {
  const char* name;
  std::vector<std::pair<const char*, GDExtensionVariantType>> arguments;
};
/// A property, and how the editor shows it.
struct PropertyRow {
  std::string name;
  GDExtensionVariantType type;
  uint32_t hint = 0;  ///< PROPERTY_HINT_...
  std::string hint_text = {};
  uint32_t usage = 6;           ///< PROPERTY_USAGE_...
  const char* group = nullptr;  ///< the group that begins here
  std::string help = {};
};
struct ClassRow {
  const char* name;
  const char* parent;
  const char* help;
  std::unique_ptr<EngineNode> (*make)();
  std::vector<MethodRow> methods;
  std::vector<SignalRow> signals;
  std::vector<PropertyRow> properties;
};

/// Registers a class; `row` must live until it is unregistered.
void register_class(const ClassRow& row);
/// Gives the editor the texts about a class: at the engine's level EDITOR.
void load_help(const ClassRow& row);
void unregister_class(const ClassRow& row);

}  // namespace palpate::godot
