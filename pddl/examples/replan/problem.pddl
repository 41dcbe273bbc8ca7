; A replan in the middle of things. carrier1 is docking rover1 at m1 until 7.000: the rover counts as aboard, and the
; carrier's start is where it stands. rover2 is driving and will be at its start at 3.000. The rest of what they do is
; part of the cost of every drive out of their starts.

(define (problem replan)
  (:domain marsupial)

  (:objects
    carrier_type - robot_type
    rover_type - robot_type
    carrier1 - carrier
    rover1 - rover
    rover2 - rover
    p1 - start
    p2 - start
    t1 - target
    t2 - target
    t3 - target
    m1 - meeting
  )

  (:init
    ; Where everybody is
    (at carrier1 p1)
    (on rover1 carrier1)
    (aboard rover1)
    (at rover2 p2)
    (= (num_docked carrier1) 1)
    ; What everybody can do
    (role_carrier carrier_type)
    (role_rover rover_type)
    (is_a carrier1 carrier_type)
    (= (capacity carrier1) 1)
    (can_explore carrier1 t3)
    (is_a rover1 rover_type)
    (= (dock_time rover1) 10.000)
    (= (undock_time rover1) 5.000)
    (can_explore rover1 t1)
    (can_explore rover1 t2)
    (can_stand rover1 m1)
    (is_a rover2 rover_type)
    (= (dock_time rover2) 10.000)
    (= (undock_time rover2) 5.000)
    (can_explore rover2 t1)
    (can_explore rover2 t2)
    (can_stand rover2 m1)
    ; How long drives take
    (path carrier_type p1 t3)
    (= (path_cost carrier_type p1 t3) 22.000)
    (path carrier_type p1 m1)
    (= (path_cost carrier_type p1 m1) 7.001)
    (path carrier_type t3 m1)
    (= (path_cost carrier_type t3 m1) 15.000)
    (path carrier_type m1 t3)
    (= (path_cost carrier_type m1 t3) 15.000)
    (path rover_type p2 t2)
    (= (path_cost rover_type p2 t2) 7.000)
    (path rover_type t1 m1)
    (= (path_cost rover_type t1 m1) 4.000)
    (path rover_type m1 t1)
    (= (path_cost rover_type m1 t1) 4.000)
    ; Records, read by no action
    (= (free_at carrier1) 7.000)
    (= (free_at rover1) 7.000)
    (= (free_at rover2) 3.000)
    (= (reveal t1) 1.0)
    (= (reveal t2) 1.0)
    (= (reveal t3) 1.0)
    (= (travel carrier_type p1 p1) 0.000)
    (= (travel carrier_type p1 m1) 0.000)
    (= (travel carrier_type t3 p1) 15.000)
    (= (travel carrier_type t3 t3) 0.000)
    (= (travel carrier_type m1 p1) 0.000)
    (= (travel carrier_type m1 m1) 0.000)
    (= (travel rover_type p2 p2) 0.000)
    (= (travel rover_type t1 t1) 0.000)
    (= (travel rover_type t2 p2) 4.000)
    (= (travel rover_type t2 t2) 0.000)
    (= (travel rover_type m1 m1) 0.000)
  )

  (:goal (and
    (explored t1)
    (explored t2)
    (explored t3)
  ))

  (:metric minimize (total-time)))
