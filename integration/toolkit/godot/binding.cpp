#include "binding.h"

namespace palpate::godot {

EngineFunctions engine;
GDExtensionClassLibraryPtr library = nullptr;

bool load_functions(GDExtensionInterfaceGetProcAddress find, GDExtensionClassLibraryPtr own) {
  library = own;
  bool found = true;
#define PALPATE_GODOT_LOAD(type, name)                                     \
  engine.name = reinterpret_cast<GDExtensionInterface##type>(find(#name)); \
  found = found && engine.name;
  PALPATE_GODOT_FUNCTIONS(PALPATE_GODOT_LOAD)
#undef PALPATE_GODOT_LOAD
  engine.editor_help_load_xml_from_utf8_chars =
      reinterpret_cast<GDExtensionsInterfaceEditorHelpLoadXmlFromUtf8Chars>(
          find("editor_help_load_xml_from_utf8_chars"));
  return found;
}

EngineName::~EngineName() {
  engine.variant_get_ptr_destructor(GDEXTENSION_VARIANT_TYPE_STRING_NAME)(&content_);
}

EngineText::~EngineText() {
  engine.variant_get_ptr_destructor(GDEXTENSION_VARIANT_TYPE_STRING)(&content_);
}

// ---- variants

namespace {

/// Pointers to variants, as the engine takes arguments.
std::vector<GDExtensionConstVariantPtr> pointers_to(Arguments values) {
  std::vector<GDExtensionConstVariantPtr> pointers;
  for (const Variant& value : values) pointers.push_back(value.get());
  return pointers;
}

}  // namespace

Variant::Variant(GDExtensionVariantType type, void* value) {
  engine.get_variant_from_type_constructor(type)(content_, value);
}

Variant::Variant(std::string_view text)
    : Variant(GDEXTENSION_VARIANT_TYPE_STRING, EngineText(text).get()) {}

Variant Variant::made_of(GDExtensionVariantType type, Arguments arguments) {
  Variant made;
  GDExtensionCallError error{};
  engine.variant_construct(type, made.content_, pointers_to(arguments).data(),
                           int32_t(arguments.size()), &error);
  return made;
}

std::string Variant::text() const {
  const EngineText text;
  engine.variant_stringify(content_, text.get());
  std::string copy(size_t(engine.string_to_utf8_chars(text.get(), nullptr, 0)), '\0');
  engine.string_to_utf8_chars(text.get(), copy.data(), GDExtensionInt(copy.size()));
  return copy;
}

void Variant::copy_to(void* typed) const {
  engine.get_variant_to_type_constructor(type())(typed, get());
}

Variant Variant::call_with(const char* method, Arguments arguments) const {
  Variant result;
  GDExtensionCallError error{};
  engine.variant_call(get(), EngineName(method).get(), pointers_to(arguments).data(),
                      GDExtensionInt(arguments.size()), result.content_, &error);
  if (error.error == GDEXTENSION_CALL_OK) return result;
  engine.print_error((std::string("palpate: the engine refuses ") + method).c_str(), method,
                     __FILE__, __LINE__, false);
  return {};
}

Variant singleton(const char* name) {
  return Variant(engine.global_get_singleton(EngineName(name).get()));
}

bool in_editor() {
  return singleton("Engine").call("is_editor_hint").is_true();
}

void warn(const std::string& sentence) {
  engine.print_warning(("palpate: " + sentence).c_str(), "palpate", "", 0, false);
}

// ---- classes

namespace {

/// What the engine reads about an argument or a property, with its texts.
class PropertyText {
 public:
  PropertyText(const char* name, GDExtensionVariantType type, uint32_t hint = 0,
               const std::string& hint_text = {}, uint32_t usage = 6)
      : name_(name), class_(""), hint_text_(hint_text) {
    // A value of any type.
    if (type == GDEXTENSION_VARIANT_TYPE_NIL) usage |= 1U << 17;
    info = {type, name_.get(), class_.get(), hint, hint_text_.get(), usage};
  }
  GDExtensionPropertyInfo info;

 private:
  EngineName name_, class_;
  EngineText hint_text_;
};

using ArgumentRows = std::vector<std::pair<const char*, GDExtensionVariantType>>;

/// The arguments of a method or a signal.
class ArgumentTexts {
 public:
  explicit ArgumentTexts(const ArgumentRows& rows) : metadata(rows.size()) {
    for (const auto& [name, type] : rows)
      infos.push_back(texts_.emplace_back(std::make_unique<PropertyText>(name, type))->info);
  }
  std::vector<GDExtensionPropertyInfo> infos;
  std::vector<GDExtensionClassMethodArgumentMetadata> metadata;

 private:
  std::vector<std::unique_ptr<PropertyText>> texts_;
};

EngineNode& node_of(GDExtensionClassInstancePtr instance) {
  return *static_cast<EngineNode*>(instance);
}

void called(void* method, GDExtensionClassInstancePtr instance,
            const GDExtensionConstVariantPtr* arguments, GDExtensionInt count,
            GDExtensionVariantPtr result, GDExtensionCallError* error) {
  const auto& row = *static_cast<const MethodRow*>(method);
  const auto wanted = GDExtensionInt(row.arguments.size());
  if (count != wanted) {
    *error = {count < wanted ? GDEXTENSION_CALL_ERROR_TOO_FEW_ARGUMENTS
                             : GDEXTENSION_CALL_ERROR_TOO_MANY_ARGUMENTS,
              0, int32_t(wanted)};
    return;
  }
  std::vector<Variant> values(static_cast<size_t>(count));
  for (size_t k = 0; k < values.size(); ++k) {
    Variant copy;
    engine.variant_destroy(copy.get());
    engine.variant_new_copy(copy.get(), arguments[k]);
    values[k] = std::move(copy);
  }
  const Variant given = row.run(node_of(instance), values);
  engine.variant_destroy(result);
  engine.variant_new_copy(result, given.get());
}

/// The same with typed arguments, as compiled scripts call.
void called_typed(void* method, GDExtensionClassInstancePtr instance,
                  const GDExtensionConstTypePtr* arguments, GDExtensionTypePtr result) {
  const auto& row = *static_cast<const MethodRow*>(method);
  std::vector<Variant> values;
  for (size_t k = 0; k < row.arguments.size(); ++k) {
    void* const value = const_cast<void*>(arguments[k]);
    const GDExtensionVariantType type = row.arguments[k].second;
    if (type == GDEXTENSION_VARIANT_TYPE_NIL) {
      Variant copy;
      engine.variant_new_copy(copy.get(), value);
      values.push_back(std::move(copy));
    } else {
      values.emplace_back(type, value);
    }
  }
  const Variant given = row.run(node_of(instance), values);
  if (!result) return;
  if (row.returns == GDEXTENSION_VARIANT_TYPE_NIL)
    engine.variant_new_copy(result, given.get());
  else if (given.type() == row.returns)
    given.copy_to(result);
}

GDExtensionClassInstancePtr recreated(void* class_row, GDExtensionObjectPtr object) {
  const auto& row = *static_cast<const ClassRow*>(class_row);
  EngineNode* const node = row.make().release();
  node->object = object;
  engine.object_set_instance(object, EngineName(row.name).get(), node);
  return node;
}

GDExtensionObjectPtr created(void* class_row, GDExtensionBool tells) {
  const auto& row = *static_cast<const ClassRow*>(class_row);
  const GDExtensionObjectPtr object =
      engine.classdb_construct_object2(EngineName(row.parent).get());
  recreated(class_row, object);
  constexpr int kPostInitialize = 0;
  if (tells) Variant(object).call("notification", kPostInitialize);
  return object;
}

void freed(void*, GDExtensionClassInstancePtr instance) {
  delete &node_of(instance);
}

void notified(GDExtensionClassInstancePtr instance, int32_t what, GDExtensionBool) {
  node_of(instance).notified(what);
}

GDExtensionBool validated(GDExtensionClassInstancePtr instance, GDExtensionPropertyInfo* property) {
  property->usage |= node_of(instance).usage_of(
      Variant(GDEXTENSION_VARIANT_TYPE_STRING_NAME, property->name).text());
  return true;
}

std::string escaped(std::string_view text) {
  std::string xml;
  for (const char c : text) {
    if (c == '&')
      xml += "&amp;";
    else if (c == '<')
      xml += "&lt;";
    else
      xml += c;
  }
  return xml;
}

/// What the editor shows of the class and its properties.
std::string help_of(const ClassRow& row) {
  std::string members;
  for (const PropertyRow& property : row.properties)
    members += "<member name=\"" + property.name + "\" type=\"Variant\" setter=\"_set_own\" " +
               "getter=\"_get_own\">" + escaped(property.help) + "</member>\n";
  return std::string("<?xml version=\"1.0\" encoding=\"UTF-8\" ?>\n<class name=\"") + row.name +
         "\" inherits=\"" + row.parent + "\"><brief_description>" + escaped(row.help) +
         "</brief_description><description></description><members>\n" + members +
         "</members></class>\n";
}

/// Every class has these two, through which the engine reads and writes its properties.
const MethodRow kGetter{"_get_own",
                        {{"index", GDEXTENSION_VARIANT_TYPE_INT}},
                        GDEXTENSION_VARIANT_TYPE_NIL,
                        [](EngineNode& node, Arguments arguments) -> Variant {
                          return node.get(size_t(arguments[0].number()));
                        }};
const MethodRow kSetter{
    "_set_own",
    {{"index", GDEXTENSION_VARIANT_TYPE_INT}, {"value", GDEXTENSION_VARIANT_TYPE_NIL}},
    GDEXTENSION_VARIANT_TYPE_NIL,
    [](EngineNode& node, Arguments arguments) -> Variant {
      node.set(size_t(arguments[0].number()), arguments[1]);
      return {};
    }};

void register_method(const ClassRow& row, const MethodRow& method) {
  ArgumentTexts arguments(method.arguments);
  const EngineName name(method.name);
  PropertyText returned("", method.returns);
  GDExtensionClassMethodInfo info{};
  info.name = name.get();
  info.method_userdata = const_cast<MethodRow*>(&method);
  info.call_func = called;
  info.ptrcall_func = called_typed;
  info.method_flags = GDEXTENSION_METHOD_FLAGS_DEFAULT;
  info.has_return_value = true;
  info.return_value_info = &returned.info;
  info.argument_count = uint32_t(arguments.infos.size());
  info.arguments_info = arguments.infos.data();
  info.arguments_metadata = arguments.metadata.data();
  engine.classdb_register_extension_class_method(library, EngineName(row.name).get(), &info);
}

}  // namespace

void register_class(const ClassRow& row) {
  const EngineName name(row.name), parent(row.parent);
  GDExtensionClassCreationInfo4 info{};
  info.is_exposed = true;
  info.notification_func = notified;
  info.validate_property_func = validated;
  info.create_instance_func = created;
  info.free_instance_func = freed;
  info.recreate_instance_func = recreated;
  info.class_userdata = const_cast<ClassRow*>(&row);
  engine.classdb_register_extension_class4(library, name.get(), parent.get(), &info);
  for (const MethodRow& method : row.methods) register_method(row, method);
  for (const MethodRow* const own : {&kGetter, &kSetter}) register_method(row, *own);
  for (const SignalRow& signal : row.signals) {
    const ArgumentTexts arguments(signal.arguments);
    engine.classdb_register_extension_class_signal(
        library, name.get(), EngineName(signal.name).get(), arguments.infos.data(),
        GDExtensionInt(arguments.infos.size()));
  }
  const EngineName setter(kSetter.name), getter(kGetter.name);
  for (size_t k = 0; k < row.properties.size(); ++k) {
    const PropertyRow& property = row.properties[k];
    if (property.group)
      engine.classdb_register_extension_class_property_group(
          library, name.get(), EngineText(property.group).get(), EngineText("").get());
    const PropertyText text(property.name.c_str(), property.type, property.hint, property.hint_text,
                            property.usage);
    engine.classdb_register_extension_class_property_indexed(
        library, name.get(), &text.info, setter.get(), getter.get(), GDExtensionInt(k));
  }
}

void load_help(const ClassRow& row) {
  if (engine.editor_help_load_xml_from_utf8_chars)
    engine.editor_help_load_xml_from_utf8_chars(help_of(row).c_str());
}

void unregister_class(const ClassRow& row) {
  engine.classdb_unregister_extension_class(library, EngineName(row.name).get());
}

}  // namespace palpate::godot
