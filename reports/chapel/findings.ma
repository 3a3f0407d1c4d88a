//Maya ASCII 2018 scene
//Codeset: UTF-8
requires maya "2018";
currentUnit -l centimeter -a degree -t film;
createNode transform -n "clerestory_findings";
createNode transform -n "D1_geometry_missing" -p "clerestory_findings";
	addAttr -ci true -sn "note" -ln "note" -dt "string";
	addAttr -ci true -sn "nts" -ln "notes" -dt "string";
	setAttr ".t" -type "double3" 11.908983 0.16155 -5.151781 ;
	setAttr -k on ".note" -type "string" "the model lacks what is there on “plaster”, 64 cm across; not sure, because as much is off elsewhere in these pictures";
	setAttr ".nts" -type "string" "the model lacks what is there on “plaster”, 64 cm across; not sure, because as much is off elsewhere in these pictures";
createNode locator -n "D1_geometry_missingShape" -p "D1_geometry_missing";
	setAttr ".los" -type "double3" 0.319558 0.319558 0.319558 ;
// End of findings.ma
