# Three nodes, one hand that presses: what it feels, which signals come, and that recordings replay.
# User arguments: a recording of the shell by the program, a file for the recording of this run.
extends SceneTree

var scene := PalpateScene.new()
var hand := PalpateHand.new()
var said := {"signals": [], "most_n": 0.0, "causes": []}
var since_opened := -1.0

func _initialize() -> void:
	var files := OS.get_cmdline_user_args()
	scene.inputs = ["shell"]
	scene.gpu = "none"
	scene.black_box = "off"
	scene.watchdog_s = 1.0
	scene.real_time = false
	scene.record = files[1]
	scene.add_child(hand)
	hand.position = Vector3(0, 0, 0.065)
	scene.opened.connect(opened.bind(files[0]))
	scene.failed.connect(func(sentence): said.failed = sentence; end())
	hand.touching.connect(func(is_touching): said.signals.append(is_touching))
	hand.cause_changed.connect(func(word, _sentence): said.causes.append(word))
	# Turned and moved as a whole: forces come back along Godot's axes.
	scene.transform = Transform3D(Basis(Vector3.UP, PI / 2), Vector3(1, 2, 3))
	root.add_child(scene)

func opened(recording: String) -> void:
	said.replay = scene.replay(recording)
	said.wrong = scene.replay("res://project.godot")
	since_opened = 0.0

func _process(delta: float) -> bool:
	if since_opened < 0.0:
		return false
	since_opened += delta
	hand.position.z = 0.065 - 0.02 * clampf(since_opened - 2.5, 0, 2.0)
	if hand.force.length() > said.most_n:
		said.most_n = hand.force.length()
		said.along = [hand.force.x, hand.force.y, hand.force.z]
		said.is_touching = hand.is_touching
	if since_opened > 5.5:
		end()
	return false

func end() -> void:
	scene.close()
	print("RESULT ", JSON.stringify(said))
	quit()
